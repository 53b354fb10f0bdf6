// Reference implementation of the crossing of a ray with a triangle, in integers, so that every sign is exact. Shares
// no arithmetic with the code under test. Used by tests of points in meshes.
#ifndef LOCUS_TESTS_SUPPORT_EXACT_CROSSING_H_
#define LOCUS_TESTS_SUPPORT_EXACT_CROSSING_H_

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>

#include "core/geometry/point_in_mesh.h"
#include "tests/support/random.h"

namespace locus::test {

using Integer = boost::multiprecision::cpp_int;

struct IntegerVector {
  std::array<Integer, 3> at;

  friend IntegerVector operator-(const IntegerVector& a, const IntegerVector& b) {
    return {{a.at[0] - b.at[0], a.at[1] - b.at[1], a.at[2] - b.at[2]}};
  }
};

// Returns value * 2^200. Precondition: the value is a multiple of 2^-200.
inline Integer scaled(double value) {
  int exponent = 0;
  const double fraction = std::frexp(value, &exponent);
  const Integer mantissa = static_cast<int64_t>(std::ldexp(fraction, 53));
  const int places = exponent - 53 + 200;
  return places >= 0 ? Integer(mantissa << places) : Integer(mantissa >> -places);
}

inline IntegerVector exactly(Vec3d v) { return {{scaled(v.x), scaled(v.y), scaled(v.z)}}; }

// Returns the sign of the area of the triangle (u, v, 0) after projection along `axis`.
inline int exact_turn(const IntegerVector& u, const IntegerVector& v, size_t axis) {
  const size_t y = (axis + 1) % 3, z = (axis + 2) % 3;
  return Integer(u.at[y] * v.at[z] - u.at[z] * v.at[y]).sign();
}

// Returns the crossing of a triangle by the ray from `point` along the x axis. The ray is moved by (e^2, -e) along y
// and z, for an infinitesimal e, and crosses the triangle if the moved ray passes through the triangle's inside.
// crossing() has another rule, but both rules give the same result for each triangle.
inline Crossing exact_crossing(Vec3d point, const Triangle& triangle) {
  const IntegerVector p = exactly(point);
  const std::array<IntegerVector, 3> corners = {exactly(to_double(triangle.a)) - p, exactly(to_double(triangle.b)) - p,
                                                exactly(to_double(triangle.c)) - p};
  const auto& [a, b, c] = corners;
  const Integer volume = a.at[0] * (b.at[1] * c.at[2] - b.at[2] * c.at[1]) +
                         b.at[0] * (c.at[1] * a.at[2] - c.at[2] * a.at[1]) +
                         c.at[0] * (a.at[1] * b.at[2] - a.at[2] * b.at[1]);
  Crossing result;
  const int side = volume.sign();
  if (side == 0) {
    result.on_surface = true;
    for (size_t axis = 0; axis < 3; ++axis) {
      bool left = false, right = false, low = true, high = true;
      for (size_t i = 0; i < 3; ++i) {
        const int turn = exact_turn(corners[i], corners[(i + 1) % 3], axis);
        left |= turn > 0;
        right |= turn < 0;
        low &= corners[i].at[axis].sign() > 0;
        high &= corners[i].at[axis].sign() < 0;
      }
      if ((left && right) || low || high) result.on_surface = false;
    }
    return result;
  }
  // Determine the turn of each edge as seen from the moved point: the sign of the area. If the area is 0, use the sign
  // of the area's change when the point moves along -z. If this change is 0, too, use the sign of the change when the
  // point moves along y.
  int lefts = 0, rights = 0;
  for (size_t i = 0; i < 3; ++i) {
    const IntegerVector &u = corners[i], &v = corners[(i + 1) % 3];
    int turn = exact_turn(u, v, 0);
    if (turn == 0) turn = u.at[1].compare(v.at[1]);
    if (turn == 0) turn = u.at[2].compare(v.at[2]);
    lefts += turn > 0;
    rights += turn < 0;
  }
  const int winding = lefts == 3 ? 1 : rights == 3 ? -1 : 0;
  if (winding * side > 0) result.winding = winding;
  return result;
}

// A triangle, and a point on or next to the triangle, its plane or its edges.
struct NearTrial {
  Triangle triangle;
  Vec3d point;
};

inline NearTrial near_trial(Random& random) {
  const double away = random.chance(0.5) ? 0 : random.magnitude(0, 24), size = random.magnitude(-8, 24);
  const bool whole = random.chance(0.3);
  const auto corner = [&] {
    const Vec3d at = Vec3d{away, away, -away} + random.vector(size);
    return whole ? to_float(Vec3d{std::round(at.x), std::round(at.y), std::round(at.z)}) : to_float(at);
  };
  NearTrial trial{{corner(), corner(), corner()}, {}};
  Triangle& t = trial.triangle;
  if (random.chance(0.1)) t.c = t.b;
  if (random.chance(0.2)) t.b.x = t.a.x;
  if (random.chance(0.2)) t.c.y = t.a.y;
  double u = random.unit(), v = random.unit();
  if (u + v > 1) u = 1 - u, v = 1 - v;
  if (random.chance(0.3)) v = 0;
  if (random.chance(0.2)) u = random.chance(0.5) ? 1 : 0;
  if (random.chance(0.5)) u = std::round(64 * u) / 64, v = std::round(64 * v) / 64;
  Vec3d& p = trial.point;
  p = to_double(t.a) * (1 - u - v) + to_double(t.b) * u + to_double(t.c) * v;
  for (int axis = 0; axis < 3; ++axis) {
    if (random.chance(0.1)) p[axis] = std::nextafter(p[axis], random.chance(0.5) ? 1e30 : -1e30);
    if (std::abs(p[axis]) < 0x1p-40) p[axis] = 0;
  }
  return trial;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_EXACT_CROSSING_H_
