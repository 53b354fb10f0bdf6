// Bytes as a faulty disk may return them: truncated, or with flipped bits or overwritten words.
#ifndef LOCUS_TESTS_SUPPORT_DAMAGED_BYTES_H_
#define LOCUS_TESTS_SUPPORT_DAMAGED_BYTES_H_

#include <string>

#include "tests/support/random.h"

namespace locus::test {

// Returns a damaged copy of `bytes`: truncated, or with one to three changes. A change flips a bit, or overwrites a
// word with a small or large number, which a reader may take for a length.
inline std::string damaged(const std::string& bytes, Random& random) {
  std::string result = bytes;
  if (random.chance(0.2)) {
    result.resize(random.below(bytes.size()));
    return result;
  }
  for (uint64_t i = 1 + random.below(3); i > 0; --i) {
    const size_t at = random.below(result.size());
    if (random.chance(0.3)) {
      const uint64_t word = random.chance(0.5) ? ~uint64_t{0} >> random.below(64) : random.below(300);
      for (size_t byte = 0; byte < 8 && at / 8 * 8 + byte < result.size(); ++byte)
        result[at / 8 * 8 + byte] = static_cast<char>(word >> 8 * byte);
    } else {
      result[at] = static_cast<char>(result[at] ^ (1 << random.below(8)));
    }
  }
  return result;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_DAMAGED_BYTES_H_
