// Rotations: a stored unit quaternion (x, y, z, w) and the double matrix it stands for. The matrix is computed by
// products and sums in a fixed order, so that every part of the house turns a vector into the same numbers.
#ifndef LOCUS_CORE_GEOMETRY_ROTATION_H_
#define LOCUS_CORE_GEOMETRY_ROTATION_H_

#include "core/geometry/vec3.h"

namespace locus {

struct Quaternion {
  float x = 0, y = 0, z = 0, w = 1;

  constexpr bool is_identity() const { return x == 0 && y == 0 && z == 0; }
  friend constexpr bool operator==(const Quaternion&, const Quaternion&) = default;
};

// | |q| - 1 |, in double.
double unit_deviation(const Quaternion& q);
// Scaled to unit length in double, rounded once; kept bit for bit where it is of unit length as far as float can tell,
// so that normalising again changes nothing. Not for a zero quaternion.
Quaternion normalized(const Quaternion& q);

// Part `weight`, 0 to 1, of the way from one unit quaternion to another, by the shorter arc: normalised linear
// interpolation in double, rounded once. `from` itself, bit for bit, where both are the same.
Quaternion blended(const Quaternion& from, const Quaternion& to, double weight);

// Rows of a rotation matrix; `to_world` is matrix * vector, `to_local` its transpose * vector.
struct Rotation {
  Vec3d row_x{1, 0, 0}, row_y{0, 1, 0}, row_z{0, 0, 1};

  constexpr Vec3d to_world(Vec3d v) const { return {dot(row_x, v), dot(row_y, v), dot(row_z, v)}; }
  constexpr Vec3d to_local(Vec3d v) const {
    return {row_x.x * v.x + row_y.x * v.y + row_z.x * v.z, row_x.y * v.x + row_y.y * v.y + row_z.y * v.z,
            row_x.z * v.x + row_y.z * v.y + row_z.z * v.z};
  }
  constexpr Vec3d column(int axis) const { return {row_x[axis], row_y[axis], row_z[axis]}; }
  // Entrywise absolute value times `half`: half extents of the axis-aligned bounds of a turned box.
  Vec3d extent_to_world(Vec3d half) const;
  Vec3d extent_to_local(Vec3d half) const;
  friend constexpr bool operator==(const Rotation&, const Rotation&) = default;
};

// Normalises in double first; the identity quaternion gives the exact identity.
Rotation rotation_of(const Quaternion& q);
// The rotation `first`, then `second`: as matrices, second * first.
Rotation compose(const Rotation& second, const Rotation& first);
Rotation inverse(const Rotation& r);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_ROTATION_H_
