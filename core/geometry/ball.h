// Closed balls: all points at distance <= radius from the centre. A radius of zero is legal. Plain data and pure
// functions; any thread.
#ifndef LOCUS_CORE_GEOMETRY_BALL_H_
#define LOCUS_CORE_GEOMETRY_BALL_H_

#include <type_traits>

#include "core/base/check.h"
#include "core/geometry/aabb.h"

namespace locus {

template <class S>
struct Ball {
  Vec3<S> center;
  S radius{};  // >= 0
};

using Ballf = Ball<float>;
using Balld = Ball<double>;

// Returns whether the ball and the box share a point. Culling of ball queries never drops a box that this test accepts.
// The test is computed in double for both scalar types and is monotone: if it accepts a box, it accepts every superset
// of that box. A primitive overlaps a ball only if this test accepts the primitive's own bounds, so culling by any
// superset of these bounds never changes a result.
template <class S>
constexpr bool reaches(const Ball<S>& ball, const Aabb<S>& box) {
  const double radius = ball.radius;
  return squared_distance(to_double(ball.center), to_double(box)) <= radius * radius;
}

// Returns the bounds of the ball, grown by 2^-40 (double) or 2^-20 (float) times the sum of the radius and the largest
// |coordinate| of the centre. The bounds overlap every box that reaches() accepts, with one exception: if the
// distance from the centre to the box is below 2^-510 on every axis, the squares of these distances underflow, and
// reaches() may accept a box that the bounds do not overlap.
template <class S>
Aabb<S> bounds_of(const Ball<S>& ball) {
  LOCUS_DCHECK_GE(ball.radius, S{0});
  constexpr S kEpsilon = static_cast<S>(std::is_same_v<S, double> ? 0x1p-40 : 0x1p-20);
  const S epsilon = kEpsilon * (max_component(abs(ball.center)) + ball.radius);
  return grown(Aabb<S>{ball.center, ball.center}, ball.radius + epsilon);
}

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_BALL_H_
