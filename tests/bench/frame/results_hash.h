// A hash of a sequence of results. With it, the results of two runs, or of two machines, are compared by comparing one
// word. Only one thread uses an object. Source: Fowler, Noll, Vo (FNV-1a), over 64-bit words.
#ifndef LOCUS_TESTS_BENCH_FRAME_RESULTS_HASH_H_
#define LOCUS_TESTS_BENCH_FRAME_RESULTS_HASH_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

namespace locus::bench {

class ResultsHash {
 public:
  void add(uint64_t value) { state_ = (state_ ^ value) * 0x100000001B3u; }
  uint64_t value() const { return state_; }
  // Returns the hash as sixteen hexadecimal digits.
  std::string text() const { return absl::StrCat(absl::Hex(state_, absl::kZeroPad16)); }

 private:
  uint64_t state_ = 0xCBF29CE484222325u;
};

// Returns the hash of one value.
inline std::string hash_of_number(uint64_t value) {
  ResultsHash hash;
  hash.add(value);
  return hash.text();
}

// Returns the hash of several values.
inline std::string hash_of_numbers(const std::vector<uint64_t>& values) {
  ResultsHash hash;
  for (const uint64_t value : values) hash.add(value);
  return hash.text();
}

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_RESULTS_HASH_H_
