// Bounds by which overlap queries decide on most objects without computing their exact shapes. Free functions; any
// thread.
#ifndef LOCUS_CORE_QUERY_KINDS_OBJECT_BOUNDS_H_
#define LOCUS_CORE_QUERY_KINDS_OBJECT_BOUNDS_H_

#include <cstdint>

#include "core/base/check.h"
#include "core/index/hash_grid/brick_scan.h"

namespace locus {

// Result of a test that uses only an object's stored position and bounds. kUndecided: the exact shape must be tested.
enum class Verdict : uint8_t { kOverlaps, kDisjoint, kUndecided };

// Bounds of an object's solid at the time of the query. Let c be the object's position at this time. The solid extends
// at most `extent` from c and contains the ball of radius `inner_radius` around c. The distance from c to the stored
// position, `position`, is at most `displacement_bound`, which includes an epsilon for rounding in the exact tests and
// in the comparisons with these bounds.
struct ObjectBounds {
  Vec3d position;
  double inner_radius;
  double extent;
  double displacement_bound;
};

// Returns the bounds of an object that is at most `displacement_bound` away from its stored position.
inline ObjectBounds object_bounds(const GridRef& object, double displacement_bound) {
  LOCUS_DCHECK_GE(displacement_bound, 0.0);
  const Vec3d position = object.entry().position;
  const double extent = object.reach();
  const double inner_radius = object.entry().kind == ShapeKind::kBall ? extent : 0;
  const double epsilon = internal::kBoundsGrowth * (max_component(abs(position)) + extent + displacement_bound);
  return {position, inner_radius, extent, displacement_bound + epsilon};
}

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_OBJECT_BOUNDS_H_
