// A hash of results in their order, so that those of two runs, or two machines, can be compared by one word. One
// object, one thread. Source: Fowler, Noll, Vo (FNV-1a), over 64-bit words.
#ifndef LOCUS_TESTS_BENCH_FRAME_RESULTS_HASH_H_
#define LOCUS_TESTS_BENCH_FRAME_RESULTS_HASH_H_

#include <cstdint>
#include <string>

#include "absl/strings/str_cat.h"

namespace locus::bench {

class ResultsHash {
 public:
  void add(uint64_t value) { state_ = (state_ ^ value) * 0x100000001B3u; }
  uint64_t value() const { return state_; }
  // Returns sixteen hexadecimal digits.
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

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_RESULTS_HASH_H_
