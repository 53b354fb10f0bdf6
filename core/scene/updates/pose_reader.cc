#include "core/scene/updates/pose_reader.h"

#include <cmath>

#include "core/base/limits.h"

namespace locus {

Reason PoseReader::read_rotation(size_t i, Quaternion& rotation) const {
  LOCUS_DCHECK(has_rotations());
  const float* q = rotations_.entry(i);
  const Quaternion given{q[0], q[1], q[2], q[3]};
  const double deviation = unit_deviation(given);
  if (!std::isfinite(deviation)) return Reason::kNotFinite;
  if (deviation > limits::kMaxQuaternionDeviation) return Reason::kOutOfRange;
  rotation = normalized(given);
  return Reason::kUnspecified;
}

}  // namespace locus
