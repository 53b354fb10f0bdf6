#include "core/index/hash_grid/brick.h"

#include <cmath>

namespace locus::internal {

BrickPlace BrickPlace::of(const GridKey& key, int exponent) {
  BrickPlace place;
  place.key = key;
  place.exponent = exponent;
  place.cells_per_unit = internal::cells_per_unit(exponent);
  place.edge = std::ldexp(1.0, exponent + kBrickBits);
  for (int axis = 0; axis < 3; ++axis) {
    place.low[axis] = static_cast<double>(key[axis]) * place.edge;
    place.center[axis] = (static_cast<double>(key[axis]) + 0.5) * place.edge;
    place.high[axis] = (static_cast<double>(key[axis]) + 1) * place.edge;
  }
  return place;
}

}  // namespace locus::internal
