// All half lines of a point: both directions along each axis. Used by tests that compare half lines.
#ifndef LOCUS_TESTS_SUPPORT_HALF_LINES_H_
#define LOCUS_TESTS_SUPPORT_HALF_LINES_H_

#include "core/geometry/point_in_mesh.h"

namespace locus::test {

inline constexpr HalfLine kHalfLines[] = {{0, false}, {1, false}, {2, false}, {0, true}, {1, true}, {2, true}};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_HALF_LINES_H_
