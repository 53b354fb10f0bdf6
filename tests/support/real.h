// Vectors in long double and rotations by the quaternion product, for references that share only the vector template
// with the product.
#ifndef LOCUS_TESTS_SUPPORT_REAL_H_
#define LOCUS_TESTS_SUPPORT_REAL_H_

#include "core/geometry/rotation.h"

namespace locus::test {

using Real = long double;
using Vec3r = Vec3<Real>;

template <class S>
constexpr Vec3r to_real(Vec3<S> v) {
  return {v.x, v.y, v.z};
}

inline Real length(Vec3r v) { return std::sqrt(dot(v, v)); }

// Returns v rotated by q / |q|: v + 2 w (u x v) + 2 u x (u x v).
inline Vec3r turned(const Quaternion& q, Vec3r v) {
  const Real n2 = Real{q.x} * q.x + Real{q.y} * q.y + Real{q.z} * q.z + Real{q.w} * q.w;
  const Vec3r u = {q.x, q.y, q.z};
  const Vec3r c = cross(u, v);
  return v + (c * Real{q.w} + cross(u, c)) * (2 / n2);
}

inline Vec3r turned_back(const Quaternion& q, Vec3r v) { return turned({-q.x, -q.y, -q.z, q.w}, v); }

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_REAL_H_
