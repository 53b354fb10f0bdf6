// A closed ball: points at distance <= radius from the centre. A radius of zero is legal.
#ifndef LOCUS_CORE_GEOMETRY_BALL_H_
#define LOCUS_CORE_GEOMETRY_BALL_H_

#include "core/geometry/aabb.h"

namespace locus {

template <class S>
struct Ball {
  Vec3<S> center;
  S radius{};
};

using Ballf = Ball<float>;
using Balld = Ball<double>;

template <class S>
constexpr Aabb<S> bounds_of(const Ball<S>& ball) {
  return grown(Aabb<S>{ball.center, ball.center}, ball.radius);
}

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_BALL_H_
