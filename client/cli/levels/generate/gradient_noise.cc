#include "client/cli/levels/generate/gradient_noise.h"

#include <cmath>

#include "client/cli/levels/generate/splitmix64.h"

namespace locus::cli {
namespace {

using Cell = std::array<int64_t, 3>;

uint64_t hash(const Cell& corner, uint64_t seed) {
  uint64_t value = seed;
  for (const int64_t coordinate : corner) value = SplitMix64(value ^ static_cast<uint64_t>(coordinate)).next();
  return value;
}

// Returns the dot product of `offset` and a gradient vector. `hash` selects the gradient among the twelve directions
// from a cube's centre to the midpoints of its edges.
double slope(uint64_t hash, const std::array<double, 3>& offset) {
  const uint64_t edge = (hash >> 32) * 12 >> 32;
  const uint64_t axis = edge / 4;
  const double first = offset[(axis + 1) % 3];
  const double second = offset[(axis + 2) % 3];
  return ((edge & 1) != 0 ? -first : first) + ((edge & 2) != 0 ? -second : second);
}

double blend(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

}  // namespace

double gradient_noise(const std::array<double, 3>& point, uint64_t seed) {
  Cell cell;
  std::array<double, 3> inside;
  std::array<double, 3> weight;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double floor = std::floor(point[axis]);
    cell[axis] = static_cast<int64_t>(floor);
    inside[axis] = point[axis] - floor;
    weight[axis] = blend(inside[axis]);
  }
  double sum = 0;
  for (size_t corner = 0; corner < 8; ++corner) {
    Cell at = cell;
    std::array<double, 3> offset = inside;
    double share = 1;
    for (size_t axis = 0; axis < 3; ++axis) {
      const bool upper = (corner >> axis & 1) != 0;
      at[axis] += upper ? 1 : 0;
      offset[axis] -= upper ? 1 : 0;
      share *= upper ? weight[axis] : 1 - weight[axis];
    }
    sum += share * slope(hash(at, seed), offset);
  }
  return sum;
}

double fractal_noise(const std::array<double, 3>& point, double wavelength, int octaves, uint64_t seed) {
  double sum = 0;
  double weight = 1;
  double weights = 0;
  double frequency = 1 / wavelength;
  for (int octave = 0; octave < octaves; ++octave) {
    const std::array<double, 3> scaled = {point[0] * frequency, point[1] * frequency, point[2] * frequency};
    sum += weight * gradient_noise(scaled, SplitMix64(seed + static_cast<uint64_t>(octave)).next());
    weights += weight;
    weight *= 0.5;
    frequency *= 2;
  }
  return sum / weights;
}

}  // namespace locus::cli
