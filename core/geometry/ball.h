// A closed ball: points at distance <= radius from the centre. A radius of zero is legal.
#ifndef LOCUS_CORE_GEOMETRY_BALL_H_
#define LOCUS_CORE_GEOMETRY_BALL_H_

#include <type_traits>

#include "core/geometry/aabb.h"

namespace locus {

template <class S>
struct Ball {
  Vec3<S> center;
  S radius{};
};

using Ballf = Ball<float>;
using Balld = Ball<double>;

// Whether the ball comes as near as the box: the one culling rule of balls. Decided in double for both scalar types and
// monotone in the box, so that a verdict which includes it for the primitive's own box may be culled by any superset.
template <class S>
constexpr bool reaches(const Ball<S>& ball, const Aabb<S>& box) {
  const double radius = ball.radius;
  return squared_distance(to_double(ball.center), to_double(box)) <= radius * radius;
}

// Grown by 2^-40 (double) or 2^-20 (float) of the magnitudes: every box that the ball reaches() overlaps these bounds.
template <class S>
Aabb<S> bounds_of(const Ball<S>& ball) {
  constexpr S kMargin = static_cast<S>(std::is_same_v<S, double> ? 0x1p-40 : 0x1p-20);
  const S margin = kMargin * (max_component(abs(ball.center)) + ball.radius);
  return grown(Aabb<S>{ball.center, ball.center}, ball.radius + margin);
}

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_BALL_H_
