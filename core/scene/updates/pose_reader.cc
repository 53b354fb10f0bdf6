#include "core/scene/updates/pose_reader.h"

#include <cmath>

#include "core/base/limits.h"

namespace locus {

Reason read_quaternion(const float* values, Quaternion& rotation) {
  const Quaternion given{values[0], values[1], values[2], values[3]};
  const double deviation = unit_deviation(given);
  if (!std::isfinite(deviation)) return Reason::kNotFinite;
  if (deviation > limits::kMaxQuaternionDeviation) return Reason::kOutOfRange;
  rotation = normalized(given);
  return Reason::kUnspecified;
}

}  // namespace locus
