// A ray and how the mesh stands that it is asked against, as they are stored: what a ray in mesh axes is rounded from.
// Plain data; immutable by use.
#ifndef LOCUS_CORE_GEOMETRY_STORED_RAY_H_
#define LOCUS_CORE_GEOMETRY_STORED_RAY_H_

#include "core/geometry/rotation.h"

namespace locus {

// world = translation + scale * (rotation * mesh), with the rotation of quaternion / |quaternion|.
struct StoredRay {
  Vec3d origin, direction;  // in world axes
  Vec3d translation;
  Quaternion quaternion;
  float scale = 1;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_STORED_RAY_H_
