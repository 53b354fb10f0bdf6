// Transform of an instance: world = translation + scale * (rotation * mesh). Queries are transformed to mesh axes in
// double; kernels then round the result to float once. Immutable after construction; any thread.
#ifndef LOCUS_CORE_GEOMETRY_TRANSFORM_H_
#define LOCUS_CORE_GEOMETRY_TRANSFORM_H_

#include "core/geometry/aabb.h"
#include "core/geometry/rotation.h"

namespace locus {

struct Transform {
  Vec3d translation;
  Quaternion quaternion;  // rotation, of length 1
  float scale = 1;        // > 0
  Rotation rotation;      // matrix of `quaternion`

  Vec3d point_to_mesh(Vec3d world) const { return direction_to_mesh(world - translation); }
  Vec3d direction_to_mesh(Vec3d world) const { return rotation.to_local(world) * (1.0 / scale); }
  Vec3d point_to_world(Vec3d mesh) const { return translation + rotation.to_world(mesh) * double{scale}; }
};

// Returns the transform with these members and the matrix of `quaternion`. Preconditions: `quaternion` has unit length
// up to limits::kMaxQuaternionDeviation; scale > 0.
Transform make_transform(Vec3d translation, const Quaternion& quaternion, float scale);

// Returns world bounds that contain a box in mesh axes. The bounds are grown by about 2^-40 of the magnitudes of the
// translation and of the scaled box, which covers the rounding errors of this function. The bounds of a part of a mesh
// lie within the bounds of the whole mesh, except for rounding errors.
Aabbd bounds_to_world(const Transform& transform, const Aabbf& mesh_box);

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_TRANSFORM_H_
