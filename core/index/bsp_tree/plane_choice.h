// Choice of the plane that divides the values of a leaf. Candidates are planes of values and, on each axis, a plane
// through the median of the centres of the bounds and a plane between that and the next centre. A plane is rejected if
// it divides badly: if a side would list more than seven eighths of the values, or both sides together more than three
// halves. Among the others the plane with the lowest cost wins: the sum over both sides of the number of values times
// the length of the edges of the box around them, an estimate of the tests of a small query. The edges, not the area:
// flat scenes have no area. Pure function; any thread.
// Source: Goldsmith and Salmon, Automatic Creation of Object Hierarchies for Ray Tracing, 1987 (the estimate).
#ifndef LOCUS_CORE_INDEX_BSP_TREE_PLANE_CHOICE_H_
#define LOCUS_CORE_INDEX_BSP_TREE_PLANE_CHOICE_H_

#include <cstddef>
#include <cstdint>
#include <optional>

#include "absl/types/span.h"
#include "core/geometry/convex_region.h"

namespace locus {

// Planes that may divide space.
enum class BspPlanes : uint8_t {
  kBest,    // planes of values or axes, whichever costs least
  kValues,  // planes of values; planes across axes only where no plane of a value divides well
  kAxes,    // planes across axes only
};

// Plane, and the number of boxes on each side of it; boxes that it cuts or touches count on both sides.
struct Division {
  Plane plane;
  size_t front = 0, back = 0;
};

// Returns the best division of `boxes`, or nullopt if every plane divides them badly. `offered` are the planes of
// values. O(boxes * (offered + 6)).
std::optional<Division> choose_division(absl::Span<const Aabbd> boxes, absl::Span<const Plane> offered,
                                        BspPlanes planes);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BSP_TREE_PLANE_CHOICE_H_
