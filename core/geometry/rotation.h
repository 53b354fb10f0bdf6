// Rotations: a stored unit quaternion (x, y, z, w) and its matrix in double. The matrix is computed by products and
// sums in a fixed order, so that all code rotates a vector to the same bits. Plain values and pure functions; any
// thread.
#ifndef LOCUS_CORE_GEOMETRY_ROTATION_H_
#define LOCUS_CORE_GEOMETRY_ROTATION_H_

#include "core/geometry/vec3.h"

namespace locus {

struct Quaternion {
  float x = 0, y = 0, z = 0, w = 1;

  // Returns whether the rotation is the identity, which w = 1 and w = -1 both represent.
  constexpr bool is_identity() const { return x == 0 && y == 0 && z == 0; }
  friend constexpr bool operator==(const Quaternion&, const Quaternion&) = default;
};

// Returns | |q| - 1 |, in double.
double unit_deviation(const Quaternion& q);
// Returns q scaled to unit length in double and rounded once. If q has unit length within float precision, returns q
// unchanged, so that normalising a result again changes nothing. q must not be zero.
Quaternion normalized(const Quaternion& q);

// Interpolates between two unit quaternions on the shorter arc, with `weight` from 0 (`from`) to 1 (`to`): normalised
// linear interpolation in double, rounded once. Returns `from`, bit for bit, if `from` equals `to`.
Quaternion blended(const Quaternion& from, const Quaternion& to, double weight);

// Rotation matrix by rows; `to_world` is matrix * vector, `to_local` is transposed matrix * vector.
struct Rotation {
  Vec3d row_x{1, 0, 0}, row_y{0, 1, 0}, row_z{0, 0, 1};

  constexpr Vec3d to_world(Vec3d v) const { return {dot(row_x, v), dot(row_y, v), dot(row_z, v)}; }
  constexpr Vec3d to_local(Vec3d v) const {
    return {row_x.x * v.x + row_y.x * v.y + row_z.x * v.z, row_x.y * v.x + row_y.y * v.y + row_z.y * v.z,
            row_x.z * v.x + row_y.z * v.y + row_z.z * v.z};
  }
  constexpr Vec3d column(int axis) const { return {row_x[axis], row_y[axis], row_z[axis]}; }
  // Return the half extents of the axis-aligned bounds of a box after a change of axes. extent_to_world() converts the
  // half extents `half` in local axes to half extents in world axes: |matrix| * half. extent_to_local() converts from
  // world axes to local axes: |transpose| * half.
  Vec3d extent_to_world(Vec3d half) const;
  Vec3d extent_to_local(Vec3d half) const;
  friend constexpr bool operator==(const Rotation&, const Rotation&) = default;
};

// Returns the matrix of q, which is normalised in double first. The identity quaternion gives the exact identity.
Rotation rotation_of(const Quaternion& q);
// Returns the rotation by `first`, then by `second`: the matrix product second * first.
Rotation compose(const Rotation& second, const Rotation& first);
Rotation inverse(const Rotation& r);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_ROTATION_H_
