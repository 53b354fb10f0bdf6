// Scale of long random tests: all of the steps, or a tenth of the steps in sanitizer and debug builds, which are slow.
#ifndef LOCUS_TESTS_SUPPORT_TEST_SCALE_H_
#define LOCUS_TESTS_SUPPORT_TEST_SCALE_H_

#include <cstdint>

namespace locus::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(NDEBUG)
inline constexpr uint64_t kSlowdown = 10;
#else
inline constexpr uint64_t kSlowdown = 1;
#endif

constexpr uint64_t scaled_count(uint64_t count) { return (count + kSlowdown - 1) / kSlowdown; }

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_TEST_SCALE_H_
