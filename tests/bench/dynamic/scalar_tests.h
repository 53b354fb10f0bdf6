// Intersection tests of a query with one object, a ball, for peers that only find candidates. Plain float code, as a
// user of such a library would write it. Inline in a header, so that each peer's file compiles them with its own
// options.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_SCALAR_TESTS_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_SCALAR_TESTS_H_

#include <algorithm>
#include <cmath>

#include "tests/bench/dynamic/contender.h"

namespace locus::bench::dynamic {

// Returns whether an object intersects the ball of radius kReach around `center`.
inline bool scalar_ball_meets(Vec3f position, float radius, Vec3f center) {
  const float reach = kReach + radius;
  return squared_length(position - center) <= reach * reach;
}

// Returns whether an object intersects the box with edges of 2 kReach around `center`.
inline bool scalar_box_meets(Vec3f position, float radius, Vec3f center) {
  const float x = std::max(0.0f, std::fabs(position.x - center.x) - kReach);
  const float y = std::max(0.0f, std::fabs(position.y - center.y) - kReach);
  const float z = std::max(0.0f, std::fabs(position.z - center.z) - kReach);
  return x * x + y * y + z * z <= radius * radius;
}

// Updates `first` if the ray hits the object nearer than `first`, or as near with a lower id. A ray that starts inside
// the object hits it at distance 0.
inline void scalar_ray_meets(const Rayf& ray, Vec3f position, float radius, uint64_t id, FirstHit& first) {
  const Vec3f to_center = position - ray.origin;
  const float along = dot(to_center, ray.direction);
  float distance = 0;
  if (squared_length(to_center) > radius * radius) {
    if (along < 0) return;
    const float rest = radius * radius - squared_length(to_center - ray.direction * along);
    if (rest < 0) return;
    distance = along - std::sqrt(rest);
  }
  if (distance < first.distance || (distance == first.distance && (!first.found || id < first.id)))
    first = {id, distance, true};
}

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_SCALAR_TESTS_H_
