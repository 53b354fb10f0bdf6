#include "core/index/hash_grid/slab_march.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.h"

namespace locus::internal {
namespace {

// Relative epsilon: multiplied by a magnitude, it covers the rounding errors of a dozen operations on numbers that are
// not much greater than this magnitude.
constexpr double kRounding = 0x1p-44;

int dominant_axis(Vec3d direction) {
  const Vec3d length = abs(direction);
  if (length.x >= length.y && length.x >= length.z) return 0;
  return length.y >= length.z ? 1 : 2;
}

}  // namespace

SlabMarch::SlabMarch(const SlabRay<double>& ray, const LevelGeometry& level, double limit)
    : origin_(ray.origin()),
      direction_(ray.direction()),
      bounds_(level.bounds),
      per_unit_(level.cells_per_unit),
      slab_edge_((1 << kBrickBits) / level.cells_per_unit),
      axis_(dominant_axis(ray.direction())) {
  LOCUS_DCHECK(!level.bounds.empty());
  LOCUS_DCHECK_GE(level.max_extent, 0.0);
  LOCUS_DCHECK_GT(level.cells_per_unit, 0.0);
  const Interval<double> part = ray.interval(bounds_);
  if (part.near > part.far || part.far < 0 || part.near > limit) return;
  part_ = {part.near, part.far};
  const double size = magnitude(bounds_);
  tube_radius_ = level.max_extent + 2 * ray.margin(size) +
                 kRounding * (max_component(abs(origin_)) + size + level.max_extent + slab_edge_);
  const Vec3d enter = point_at(std::max(part.near, 0.0));
  const Vec3d leave = point_at(std::min(part.far, std::max(limit, 0.0)));
  bricks_ = std::numeric_limits<double>::infinity();
  if (!is_finite(enter) || !is_finite(leave) || !std::isfinite(tube_radius_)) return;
  step_ = direction_[axis_] < 0 ? -1 : 1;
  const auto index_at = [this](double x) {
    return brick_index(std::clamp(x, bounds_.min[axis_], bounds_.max[axis_]), per_unit_);
  };
  first_ = index_at(enter[axis_] - tube_radius_ * static_cast<double>(step_));
  slabs_ = (index_at(leave[axis_] + tube_radius_ * static_cast<double>(step_)) - first_) * step_ + 1;
  const Vec3d path = abs(leave - enter);
  bricks_ = static_cast<double>(slabs_) + (path.x + path.y + path.z - path[axis_]) / slab_edge_;
}

SlabMarch::Crossing SlabMarch::cross(double index, double edge, double limit) const {
  const double low = index * edge - tube_radius_, high = (index + 1) * edge + tube_radius_;
  const double o = origin_[axis_], d = direction_[axis_];
  const double enter = ((step_ > 0 ? low : high) - o) / d, leave = ((step_ > 0 ? high : low) - o) / d;
  Crossing crossing{std::max(enter, part_.near), Aabbd()};
  const double t0 = std::max({enter, part_.near, 0.0});
  const double t1 = std::min({leave, part_.far, std::max(limit, 0.0)});
  if (t0 > t1) return crossing;
  const Vec3d a = point_at(t0), b = point_at(t1);
  const Aabbd near = grown(Aabbd{min(a, b), max(a, b)}, tube_radius_);
  crossing.positions = {max(near.min, bounds_.min), min(near.max, bounds_.max)};
  return crossing;
}

SlabMarch::Slab SlabMarch::slab(int64_t n, double limit) const {
  LOCUS_DCHECK(0 <= n && n < slabs_);
  const int64_t index = first_ + n * step_;
  const Crossing crossing = cross(static_cast<double>(index), slab_edge_, limit);
  Slab slab{crossing.near, {{0, 0, 0}, {-1, -1, -1}}};
  if (crossing.positions.empty()) return slab;
  slab.bricks = bricks_within(crossing.positions, per_unit_);
  slab.bricks.lo[axis_] = slab.bricks.hi[axis_] = index;
  return slab;
}

SlabMarch::Layer SlabMarch::layer(int64_t n, int layer_index, double limit) const {
  LOCUS_DCHECK(0 <= n && n < slabs_);
  LOCUS_DCHECK(0 <= layer_index && layer_index < 1 << kBrickBits);
  const int64_t within = step_ > 0 ? layer_index : (1 << kBrickBits) - 1 - layer_index;
  const int64_t index = ((first_ + n * step_) << kBrickBits) + within;
  const Crossing crossing = cross(static_cast<double>(index), slab_edge_ / (1 << kBrickBits), limit);
  Layer layer{crossing.near, {{0, 0, 0}, {-1, -1, -1}}};
  if (crossing.positions.empty()) return layer;
  layer.cells = cells_within(crossing.positions, per_unit_);
  layer.cells.lo[axis_] = layer.cells.hi[axis_] = index;
  return layer;
}

}  // namespace locus::internal
