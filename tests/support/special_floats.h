// Floats that untrusted columns may contain.
#ifndef LOCUS_TESTS_SUPPORT_SPECIAL_FLOATS_H_
#define LOCUS_TESTS_SUPPORT_SPECIAL_FLOATS_H_

#include <limits>

namespace locus::test {

inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SPECIAL_FLOATS_H_
