// Filter for cases by name: it selects the names in which a regular expression matches anywhere. Used by every suite.
// Copies are cheap, since they share the compiled expression; const members may run concurrently.
#ifndef LOCUS_TESTS_BENCH_FRAME_CASE_FILTER_H_
#define LOCUS_TESTS_BENCH_FRAME_CASE_FILTER_H_

#include <regex.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace locus::bench {

class CaseFilter {
 public:
  // Selects every case.
  CaseFilter() = default;

  // Compiles a pattern in POSIX extended syntax; an empty pattern selects every case. Returns INVALID_ARGUMENT with the
  // reason if the pattern is not valid.
  static absl::StatusOr<CaseFilter> create(const std::string& pattern);

  bool wants(const std::string& case_name) const;
  // Returns whether there is no pattern.
  bool wants_every() const { return pattern_ == nullptr; }

 private:
  std::shared_ptr<const regex_t> pattern_;
};

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_CASE_FILTER_H_
