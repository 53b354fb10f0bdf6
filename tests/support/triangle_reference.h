// Random triangles of every kind, including slivers and triangles without area, and their distance from a point,
// computed by search in long double. Used by tests.
#ifndef LOCUS_TESTS_SUPPORT_TRIANGLE_REFERENCE_H_
#define LOCUS_TESTS_SUPPORT_TRIANGLE_REFERENCE_H_

#include <cstdint>
#include <tuple>
#include <utility>

#include "core/geometry/triangle.h"
#include "tests/support/convex_reference.h"
#include "tests/support/random.h"

namespace locus::test {

// Returns a general triangle, a sliver, a segment or a point, of any size.
inline Triangle random_triangle(Random& random) {
  const Vec3d place = random.vector(random.magnitude(0, 10));
  const double size = random.magnitude(-6, 6);
  Triangle t{to_float(place + random.vector(size)), to_float(place + random.vector(size)), {}, 0};
  t.c = to_float(place + random.vector(size));
  if (random.chance(0.3)) {  // a sliver: the third vertex is almost on the line through the other two
    const Vec3d along = to_double(t.a) + (to_double(t.b) - to_double(t.a)) * random.between(-0.5, 1.5);
    t.c = to_float(along + random.vector(size * random.magnitude(-24, -2)));
  }
  if (random.chance(0.05)) t.c = t.b;
  if (random.chance(0.02)) t.a = t.b = t.c;
  return t;
}

inline double size_of(const Triangle& t) { return std::sqrt(squared_length(to_double(bounds_of(t)).extent())); }

// Returns the distance of a point from a triangle: the minimum over all barycentric weights u and v, found by nested
// searches, since the distance is convex in each weight.
inline Real reference_distance(Vec3r point, const Triangle& t) {
  const Vec3r a = to_real(t.a) - point, ab = to_real(t.b) - to_real(t.a), ac = to_real(t.c) - to_real(t.a);
  const auto nearest_v = [&](Real u) {
    const auto distance = [&](Real v) { return length(a + ab * u + ac * v); };
    const Real limit = 1 - u;
    return std::min(distance(argmin(distance, 0, limit)), std::min(distance(0), distance(limit)));
  };
  return std::min(nearest_v(argmin(nearest_v, 0, 1)), std::min(nearest_v(0), nearest_v(1)));
}

// Generates a triangle as thin as floats allow: two vertices have whole coordinates, and their x and y components have
// a cross product of 1; the third vertex is near the origin. Only a few bits of its normal are significant.
inline Triangle hairline(Random& random) {
  constexpr int64_t kLargest = 1 << 21;
  int64_t p = random.whole(1, kLargest), q = random.whole(1, kLargest);
  // Extended Euclid: p * s - q * r = 1 for coprime p and q.
  int64_t r0 = p, r1 = q, s0 = 1, s1 = 0, t0 = 0, t1 = 1;
  while (r1 != 0) {
    const int64_t n = r0 / r1;
    std::tie(r0, r1) = std::pair(r1, r0 - n * r1);
    std::tie(s0, s1) = std::pair(s1, s0 - n * s1);
    std::tie(t0, t1) = std::pair(t1, t0 - n * t1);
  }
  p /= r0, q /= r0;
  const int64_t s = s0, r = -t0;
  const Vec3d b = {double(p), double(q), double(p + q)}, c = {double(r), double(s), double(r + s)};
  return {to_float(random.vector(random.magnitude(-26, 0))), to_float(b), to_float(c), 0};
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_TRIANGLE_REFERENCE_H_
