#include "core/geometry/transform.h"

#include "core/base/check.h"
#include "core/base/limits.h"

namespace locus {

Transform make_transform(Vec3d translation, const Quaternion& quaternion, float scale) {
  LOCUS_DCHECK_GT(scale, 0.0f);
  LOCUS_DCHECK_LE(unit_deviation(quaternion), limits::kMaxQuaternionDeviation);
  return {translation, quaternion, scale, rotation_of(quaternion)};
}

Aabbd bounds_to_world(const Transform& transform, const Aabbf& mesh_box) {
  constexpr double kEpsilon = 0x1p-40;
  const Aabbd box = to_double(mesh_box);
  const Vec3d center = (box.min + box.max) * 0.5;
  const Vec3d half = (box.max - box.min) * 0.5;
  const Vec3d world_center = transform.point_to_world(center);
  const Vec3d world_half = transform.rotation.extent_to_world(half) * double{transform.scale};
  const double epsilon =
      kEpsilon * (max_component(abs(transform.translation)) + 4.0 * transform.scale * magnitude(box));
  return grown(Aabbd{world_center - world_half, world_center + world_half}, epsilon);
}

}  // namespace locus
