#include "core/geometry/compound.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/limits.h"

namespace locus {

Compound::Compound(std::vector<Part> parts) : parts_(std::move(parts)) {
  LOCUS_CHECK(!parts_.empty() && parts_.size() <= limits::kMaxParts);
  parts_.shrink_to_fit();  // so that bytes() is right
  extents_.reserve(parts_.size());
  double extent = 0;
  for (const Part& part : parts_) {
    LOCUS_DCHECK(part.kind != ShapeKind::kPoint && part.kind != ShapeKind::kCompound);
    const Shape shape{part.kind, to_double(part.position), part.rotation, part.size, part.radius};
    extents_.push_back(double{extent_of(shape)});
    extent = std::max(extent, std::sqrt(squared_length(shape.position)) + extents_.back());
    layers_ |= part.layers;
  }
  extent_ = std::nextafter(static_cast<float>(extent), std::numeric_limits<float>::infinity());
}

Quaternion product(const Quaternion& second, const Quaternion& first) {
  const double ax = second.x, ay = second.y, az = second.z, aw = second.w;
  const double bx = first.x, by = first.y, bz = first.z, bw = first.w;
  const double x = aw * bx + ax * bw + ay * bz - az * by, y = aw * by - ax * bz + ay * bw + az * bx;
  const double z = aw * bz + ax * by - ay * bx + az * bw, w = aw * bw - ax * bx - ay * by - az * bz;
  const double length = std::sqrt(x * x + y * y + z * z + w * w);
  LOCUS_DCHECK_GE(length, 0.5);
  return {static_cast<float>(x / length), static_cast<float>(y / length), static_cast<float>(z / length),
          static_cast<float>(w / length)};
}

Aabbd PlacedCompound::bounds() const {
  Aabbd bounds;
  for (uint32_t part = 0; part < compound_.parts().size(); ++part) bounds = merge(bounds, bounds_of(shape(part)));
  return bounds;
}

}  // namespace locus
