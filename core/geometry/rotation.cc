#include "core/geometry/rotation.h"

#include <cmath>

#include "core/base/check.h"

namespace locus {
namespace {

double length(const Quaternion& q) {
  const double x = q.x, y = q.y, z = q.z, w = q.w;
  return std::sqrt(x * x + y * y + z * z + w * w);
}

}  // namespace

double unit_deviation(const Quaternion& q) { return std::abs(length(q) - 1.0); }

Quaternion normalized(const Quaternion& q) {
  // Rounding to float changes the length of a unit quaternion by at most four half units in the last place.
  constexpr double kRounding = 0x1p-23;
  const double n = length(q);
  LOCUS_DCHECK_GT(n, 0.0);
  if (std::abs(n - 1.0) <= kRounding) return q;
  return {static_cast<float>(q.x / n), static_cast<float>(q.y / n), static_cast<float>(q.z / n),
          static_cast<float>(q.w / n)};
}

Quaternion blended(const Quaternion& from, const Quaternion& to, double weight) {
  LOCUS_DCHECK_GE(weight, 0.0);
  LOCUS_DCHECK_LE(weight, 1.0);
  if (from == to) return from;
  const double ax = from.x, ay = from.y, az = from.z, aw = from.w;
  const double bx = to.x, by = to.y, bz = to.z, bw = to.w;
  const double from_weight = 1 - weight;
  const double to_weight = ax * bx + ay * by + az * bz + aw * bw < 0 ? -weight : weight;
  const double x = ax * from_weight + bx * to_weight, y = ay * from_weight + by * to_weight;
  const double z = az * from_weight + bz * to_weight, w = aw * from_weight + bw * to_weight;
  const double n = std::sqrt(x * x + y * y + z * z + w * w);  // at least 0.7 for unit quaternions
  LOCUS_DCHECK_GE(n, 0.5);
  return {static_cast<float>(x / n), static_cast<float>(y / n), static_cast<float>(z / n), static_cast<float>(w / n)};
}

Vec3d Rotation::extent_to_world(Vec3d half) const {
  return {dot(abs(row_x), half), dot(abs(row_y), half), dot(abs(row_z), half)};
}

Vec3d Rotation::extent_to_local(Vec3d half) const {
  return {dot(abs(column(0)), half), dot(abs(column(1)), half), dot(abs(column(2)), half)};
}

Rotation rotation_of(const Quaternion& q) {
  if (q.is_identity()) return {};
  const double n = length(q);
  LOCUS_DCHECK_GT(n, 0.0);
  const double x = q.x / n, y = q.y / n, z = q.z / n, w = q.w / n;
  return {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
}

Rotation inverse(const Rotation& r) { return {r.column(0), r.column(1), r.column(2)}; }

Rotation compose(const Rotation& second, const Rotation& first) {
  const Vec3d x = second.to_world(first.column(0));
  const Vec3d y = second.to_world(first.column(1));
  const Vec3d z = second.to_world(first.column(2));
  return inverse(Rotation{x, y, z});
}

}  // namespace locus
