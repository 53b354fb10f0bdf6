#include "core/geometry/obb.h"

#include "core/base/check.h"

namespace locus {
namespace {

// Pair of boxes `a` and `b`, in the own axes of `a`.
struct Pair {
  Vec3d offset;  // from the centre of `a` to the centre of `b`
  Vec3d half_a, half_b;
  Vec3d axes_b[3];
  double tolerance;  // bound of the rounding error of a projection on an axis of length 1
};

double manhattan(Vec3d v) {
  const Vec3d a = abs(v);
  return a.x + a.y + a.z;
}

Pair pair_of(const Obbd& a, const Obbd& b) {
  Pair pair;
  pair.offset = a.rotation.to_local(b.center - a.center);
  pair.half_a = a.half;
  pair.half_b = b.half;
  for (int axis = 0; axis < 3; ++axis) pair.axes_b[axis] = a.rotation.to_local(b.rotation.column(axis));
  const bool rotated = !(a.rotation == Rotation{} && b.rotation == Rotation{});
  pair.tolerance = rotated ? 0x1p-49 * (manhattan(pair.offset) + manhattan(a.half) + manhattan(b.half)) : 0;
  return pair;
}

bool separated_along(const Pair& pair, Vec3d axis) {
  double extent = dot(abs(axis), pair.half_a);
  for (int j = 0; j < 3; ++j) extent += pair.half_b[j] * std::abs(dot(pair.axes_b[j], axis));
  return std::abs(dot(pair.offset, axis)) > extent + pair.tolerance * manhattan(axis);
}

}  // namespace

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

bool boxes_overlap(const Obbd& a, const Obbd& b) {
  const Pair pair = pair_of(a, b);
  constexpr Vec3d kUnit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int i = 0; i < 3; ++i) {
    if (separated_along(pair, kUnit[i]) || separated_along(pair, pair.axes_b[i])) return false;
  }
  for (const Vec3d unit : kUnit) {
    for (const Vec3d axis_b : pair.axes_b) {
      if (separated_along(pair, cross(unit, axis_b))) return false;
    }
  }
  return true;
}

}  // namespace locus
