#include "core/index/hash_grid/brick.h"

#include <cmath>

namespace locus::internal {

BrickGeometry BrickGeometry::of(const GridKey& key, int exponent) {
  BrickGeometry geometry;
  geometry.key = key;
  geometry.exponent = exponent;
  geometry.cells_per_unit = internal::cells_per_unit(exponent);
  geometry.edge = std::ldexp(1.0, exponent + kBrickBits);
  for (int axis = 0; axis < 3; ++axis) {
    geometry.low[axis] = static_cast<double>(key[axis]) * geometry.edge;
    geometry.center[axis] = (static_cast<double>(key[axis]) + 0.5) * geometry.edge;
    geometry.high[axis] = (static_cast<double>(key[axis]) + 1) * geometry.edge;
  }
  return geometry;
}

}  // namespace locus::internal
