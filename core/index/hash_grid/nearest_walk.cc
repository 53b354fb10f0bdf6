#include "core/index/hash_grid/nearest_walk.h"

#include <cmath>

#include "core/base/check.h"

namespace locus::internal {
namespace {

constexpr double kFirstShellValues = 12;  // target number of values in the first shell
constexpr uint32_t kMinForEstimate = 4;   // min number of values for an estimate of the density
constexpr double kShellGrowth = 1.6;      // ratio of shell_width_ to its value for the previous shell

// Returns the input of the kernel collect_near() for a shell. GridNear::point is relative to the centre of the brick.
GridNear near_of(const Brick& brick, const Vec3d& point, float above, float up_to) {
  const Vec3d to_point = point - brick.geometry.center;
  GridNear near;
  for (int axis = 0; axis < 3; ++axis) near.point[axis] = static_cast<float>(to_point[axis]);
  const double epsilon = cull_epsilon(brick) + double{kCullEpsilon} * max_component(abs(to_point));
  near.epsilon = static_cast<float>(epsilon * (1 + double{kCullEpsilon}));
  near.above = above;
  near.up_to = up_to;
  return near;
}

// Returns the epsilon by which the sides of a shell's region are moved outwards, so that the region overlaps the bounds
// of every value whose key lies in the shell. It covers the part of the rounding errors of keys and sides that does not
// grow with the distance from the point; region_within() also scales the region, which covers the rest.
double epsilon_of(const Vec3d& point, const LevelGeometry& level) {
  const double edge = (1 << kBrickBits) / level.cells_per_unit;
  const double size = max_component(abs(point)) + magnitude(level.bounds);
  return 8 * (double{kCullEpsilon} * (edge + level.max_extent) + kBoundsGrowth * (size + edge + level.max_extent));
}

}  // namespace

float key_limit(double limit) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (limit >= kLargest / 2) return std::numeric_limits<float>::infinity();
  // the added constant covers keys that underflow
  return static_cast<float>(limit * (1 + double{kCullEpsilon})) + 0x1p-120f;
}

double values_per_cell(const Brick& brick, const Vec3d& point) {
  // Counts the values in those cells of the brick that adjoin the cell corner nearest to the point.
  constexpr int kLast = (1 << kBrickBits) - 1;
  int low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = (point[axis] - brick.geometry.low[axis]) * brick.geometry.cells_per_unit;
    // The numbers are truncated on purpose; the clamp corrects those below 0.
    low[axis] = std::clamp(static_cast<int>(cells - 0.5), 0, kLast);   // NOLINT(bugprone-incorrect-roundings)
    high[axis] = std::clamp(static_cast<int>(cells + 0.5), 0, kLast);  // NOLINT(bugprone-incorrect-roundings)
  }
  uint32_t values = 0;
  for (int z = low[2]; z <= high[2]; ++z) {
    for (int y = low[1]; y <= high[1]; ++y) {
      const auto row = static_cast<size_t>(z << (2 * kBrickBits) | y << kBrickBits);
      values += brick.sorted->offsets()[row + static_cast<size_t>(high[0]) + 1] -
                brick.sorted->offsets()[row + static_cast<size_t>(low[0])];
    }
  }
  if (values < kMinForEstimate) return brick.size() < kMinForEstimate ? 0 : brick.size() / double{kBrickCells};
  return static_cast<double>(values) / ((high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1));
}

double values_per_cell(const LevelGeometry& level, size_t values) {
  const Vec3d cells = (level.bounds.max - level.bounds.min) * level.cells_per_unit;
  return static_cast<double>(values) / ((cells.x + 1) * (cells.y + 1) * (cells.z + 1));
}

NearestShells::NearestShells(const Vec3d& point, const LevelGeometry& level, double per_cell)
    : point_(point), level_(level), epsilon_(epsilon_of(point, level)) {
  LOCUS_DCHECK_GT(per_cell, 0.0);
  constexpr float kBall = 4.18879f;  // volume of a ball of radius 1
  const double cells = std::cbrt(static_cast<float>(kFirstShellValues) / (kBall * static_cast<float>(per_cell)));
  bounds_distance_ = std::sqrt(squared_distance(point, level.bounds));
  shell_width_ = cells / level.cells_per_unit;
}

Aabbd NearestShells::region_within(double limit) const {
  return grown(Aabbd{point_, point_}, std::sqrt(limit) * (1 + 16 * double{kCullEpsilon}) + epsilon_);
}

bool NearestShells::next(double limit) {
  const float last = key_limit(limit);
  if (up_to_ >= last) return false;
  if (up_to_ >= 0) shell_width_ *= kShellGrowth;
  above_ = up_to_;
  const double squared = (bounds_distance_ + shell_width_) * (bounds_distance_ + shell_width_);
  region_ = region_within(squared);
  if (squared < limit && !contains(region_, level_.bounds)) {
    up_to_ = key_limit(squared);
    LOCUS_DCHECK_LE(above_, up_to_);
    return true;
  }
  up_to_ = last;
  LOCUS_DCHECK_LT(above_, up_to_);
  region_ = region_within(limit);
  return true;
}

void NearCandidates::collect(const Brick& brick, const KeyRange& cells, const Vec3d& point, float above, float up_to,
                             Work& work) {
  const GridNear near = near_of(brick, point, above, up_to);
  const GridRows rows = rows_of(brick, cells);
  work.cells += rows.count;
  if (rows.count != 0) collect_rows(*brick.sorted, brick.index, rows, near);
  if (brick.recent_count != 0) collect_recent(brick, near, work);
}

void NearCandidates::collect_recent(const Brick& brick, const GridNear& near, Work& work) {
  const GridKernels& kernels = active_grid_kernels();
  const auto source = static_cast<uint32_t>(sources_.size());
  sources_.push_back({brick.recent.get(), brick.index});
  float keys[GridRows::kMaxValues + GridBlock::kLanes];
  size_t next = 0;
  const auto cull = [&](const GridRows& rows, uint32_t* slots) {
    next = 0;
    return kernels.collect_near(rows, near, slots, keys);
  };
  Work collected;  // its `tests` are ignored: visit() counts the tests
  scan_recent(brick, collected, cull, [&](const GridRef& value) {
    candidates_.push_back({keys[next++], value.slot(), source});
    return true;
  });
  work.cells += collected.cells;
}

void NearCandidates::collect_rows(const GridBlock& block, uint32_t brick, const GridRows& rows, const GridNear& near) {
  const GridKernels& kernels = active_grid_kernels();
  sources_.push_back({&block, brick});
  uint32_t slots[GridRows::kMaxValues + GridBlock::kLanes];
  float keys[GridRows::kMaxValues + GridBlock::kLanes];
  for_each_part(rows, [&](const GridRows& part) {
    add(slots, keys, kernels.collect_near(part, near, slots, keys));
    return true;
  });
}

void NearCandidates::add(const uint32_t* slots, const float* keys, uint32_t count) {
  LOCUS_DCHECK(!sources_.empty());
  const auto source = static_cast<uint32_t>(sources_.size() - 1);
  const size_t before = candidates_.size();
  candidates_.resize(before + count);
  for (uint32_t i = 0; i < count; ++i) {
    LOCUS_DCHECK_GE(keys[i], 0.0f);
    candidates_[before + i] = {keys[i], slots[i], source};
    sources_[source].block->prefetch_entry(slots[i]);
  }
}

void NearCandidates::sort() {
  const auto before = [](const Candidate& a, const Candidate& b) { return a.key < b.key; };
  const auto count = static_cast<uint32_t>(candidates_.size());
  if (count > kMaxSorted) {
    std::sort(candidates_.begin(), candidates_.end(), before);
    return;
  }
  // Sorts integers instead of floats: keys are not negative, so their bits, read as integers, have the same order. The
  // lowest bits of each key are replaced by the index of its candidate.
  int32_t packed[kMaxSorted];
  Candidate given[kMaxSorted];
  for (uint32_t i = 0; i < count; ++i) {
    given[i] = candidates_[i];
    packed[i] = (std::bit_cast<int32_t>(given[i].key) & ~kIndexMask) | static_cast<int32_t>(i);
  }
  active_grid_kernels().sort_few(packed, count);
  for (uint32_t i = 0; i < count; ++i) {
    candidates_[i] = given[packed[i] & kIndexMask];
    candidates_[i].key = std::bit_cast<float>(packed[i] & ~kIndexMask);
  }
  LOCUS_DCHECK(std::is_sorted(candidates_.begin(), candidates_.end(), before));
}

}  // namespace locus::internal
