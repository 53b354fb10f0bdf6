#include "core/geometry/obb.h"

#include "core/base/check.h"

namespace locus {

template <class S>
Aabbd bounds_of(const Obb<S>& box) {
  const Vec3d center = to_double(box.center);
  const Vec3d half = to_double(box.half);
  LOCUS_DCHECK(half.x >= 0 && half.y >= 0 && half.z >= 0);
  if (box.rotation == Rotation{}) return {center - half, center + half};
  constexpr double kEpsilon = 0x1p-40;
  const Vec3d extent = box.rotation.extent_to_world(half);
  const double epsilon = kEpsilon * (max_component(abs(center)) + max_component(extent));
  return grown(Aabbd{center - extent, center + extent}, epsilon);
}

template Aabbd bounds_of<float>(const Obb<float>& box);
template Aabbd bounds_of<double>(const Obb<double>& box);

}  // namespace locus
