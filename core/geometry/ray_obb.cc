#include "core/geometry/ray_obb.h"

#include <limits>

#include "core/base/check.h"

namespace locus {
namespace {

// Returns the unit vector of `axis` with the sign of `sign`.
Vec3d axis_normal(int axis, double sign) {
  Vec3d normal;
  normal[axis] = sign < 0 ? -1 : 1;
  return normal;
}

}  // namespace

std::optional<Chord> chord_of_box(const Line& line, Vec3d half) {
  LOCUS_DCHECK(half.x >= 0 && half.y >= 0 && half.z >= 0);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Chord chord{-kInfinity, kInfinity, -line.direction, line.direction};
  for (int axis = 0; axis < 3; ++axis) {
    const double o = line.origin[axis];
    const double d = line.direction[axis];
    if (d == 0) {
      if (std::abs(o) > half[axis]) return std::nullopt;
      continue;
    }
    const double entry = (d > 0 ? -half[axis] - o : half[axis] - o) / d;
    const double exit = (d > 0 ? half[axis] - o : -half[axis] - o) / d;
    if (entry > chord.near) {
      chord.near = entry;
      chord.near_normal = axis_normal(axis, -d);
    }
    if (exit < chord.far) {
      chord.far = exit;
      chord.far_normal = axis_normal(axis, d);
    }
  }
  if (!(chord.near <= chord.far)) return std::nullopt;
  return chord;
}

bool box_contains(Vec3d half, Vec3d point) {
  return std::abs(point.x) <= half.x && std::abs(point.y) <= half.y && std::abs(point.z) <= half.z;
}

}  // namespace locus
