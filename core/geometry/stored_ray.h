// Ray in world axes together with the transform of the mesh, both as stored: the unrounded input from which a ray in
// mesh axes is computed. Plain data.
#ifndef LOCUS_CORE_GEOMETRY_STORED_RAY_H_
#define LOCUS_CORE_GEOMETRY_STORED_RAY_H_

#include "core/geometry/rotation.h"

namespace locus {

// Ray and transform of the mesh: world = translation + scale * (rotation * mesh), with the rotation of quaternion /
// |quaternion|.
struct StoredRay {
  Vec3d origin, direction;  // in world axes
  Vec3d translation;
  Quaternion quaternion;
  float scale = 1;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_STORED_RAY_H_
