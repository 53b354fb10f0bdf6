#include "core/scene/pose_reader.h"

#include <cmath>

#include "core/base/limits.h"

namespace locus {

Reason PoseReader::read_position(size_t i, Vec3d& position) const {
  if (positions_f64_.given()) {
    const double* p = positions_f64_.entry(i);
    position = {p[0], p[1], p[2]};
  } else {
    const float* p = positions_.entry(i);
    position = frame_ + to_double(Vec3f{p[0], p[1], p[2]});
  }
  const double largest = max_component(abs(position));
  if (largest <= limits::kMaxCoordinate && is_finite(position)) return Reason::kUnspecified;
  return is_finite(position) ? Reason::kOutOfRange : Reason::kNotFinite;
}

Reason PoseReader::read_rotation(size_t i, Quaternion& rotation) const {
  const float* q = rotations_.entry(i);
  const Quaternion given{q[0], q[1], q[2], q[3]};
  const double deviation = unit_deviation(given);
  if (!std::isfinite(deviation)) return Reason::kNotFinite;
  if (deviation > limits::kMaxQuaternionDeviation) return Reason::kOutOfRange;
  rotation = normalized(given);
  return Reason::kUnspecified;
}

}  // namespace locus
