#include "core/index/hash_grid/nearest_walk.h"

#include <cmath>

namespace locus::internal {
namespace {

constexpr double kFirstValues = 12;   // that the first shell is to hold, about
constexpr uint32_t kEnoughToSay = 4;  // of values, how many there are around
constexpr double kWider = 1.6;        // each next one

GridNear near_of(const Brick& brick, const Vec3d& point, float above, float upto) {
  const Vec3d to_point = point - brick.place.center;
  GridNear near;
  for (int axis = 0; axis < 3; ++axis) near.point[axis] = static_cast<float>(to_point[axis]);
  const double margin = cull_margin(brick) + double{kCullSlack} * max_component(abs(to_point));
  near.margin = static_cast<float>(margin * (1 + double{kCullSlack}));
  near.above = above;
  near.upto = upto;
  return near;
}

// How far off the sides of a region may be that holds all keys of a shell: more than twice what near_of() adds, and the
// rounding of the sides.
double slack_of(const Vec3d& point, const LevelExtent& level) {
  const double edge = (1 << kBrickBits) / level.cells_per_unit;
  const double size = max_component(abs(point)) + magnitude(level.bounds);
  return 8 * (double{kCullSlack} * (edge + level.reach) + kBoundsGrowth * (size + edge + level.reach));
}

}  // namespace

float key_limit(double limit) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (limit >= kLargest / 2) return std::numeric_limits<float>::infinity();
  return static_cast<float>(limit * (1 + double{kCullSlack})) + 0x1p-120f;  // which covers keys that underflow
}

double values_per_cell(const Brick& brick, const Vec3d& point) {
  // The cells around the corner that is nearest to the point, as far as they are in the brick.
  constexpr int kLast = (1 << kBrickBits) - 1;
  int low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = (point[axis] - brick.place.low[axis]) * brick.place.cells_per_unit;
    low[axis] = std::clamp(static_cast<int>(cells - 0.5), 0, kLast);
    high[axis] = std::clamp(static_cast<int>(cells + 0.5), 0, kLast);
  }
  uint32_t values = 0;
  for (int z = low[2]; z <= high[2]; ++z) {
    for (int y = low[1]; y <= high[1]; ++y) {
      const auto row = static_cast<size_t>(z << (2 * kBrickBits) | y << kBrickBits);
      values += brick.sorted->offsets()[row + static_cast<size_t>(high[0]) + 1] -
                brick.sorted->offsets()[row + static_cast<size_t>(low[0])];
    }
  }
  if (values < kEnoughToSay) return brick.size() < kEnoughToSay ? 0 : brick.size() / double{kBrickCells};
  return static_cast<double>(values) / ((high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1));
}

double values_per_cell(const LevelExtent& level, size_t values) {
  const Vec3d cells = (level.bounds.max - level.bounds.min) * level.cells_per_unit;
  return static_cast<double>(values) / ((cells.x + 1) * (cells.y + 1) * (cells.z + 1));
}

NearestShells::NearestShells(const Vec3d& point, const LevelExtent& level, double per_cell)
    : point_(point), level_(level), slack_(slack_of(point, level)) {
  constexpr float kBall = 4.18879f;  // the volume of one with the radius 1
  const double cells = std::cbrt(static_cast<float>(kFirstValues) / (kBall * static_cast<float>(per_cell)));
  away_ = std::sqrt(squared_distance(point, level.bounds));
  width_ = cells / level.cells_per_unit;
}

Aabbd NearestShells::region_within(double limit) const {
  return grown(Aabbd{point_, point_}, std::sqrt(limit) * (1 + 16 * double{kCullSlack}) + slack_);
}

bool NearestShells::next(double limit) {
  const float last = key_limit(limit);
  if (upto_ >= last) return false;
  if (upto_ >= 0) width_ *= kWider;
  above_ = upto_;
  const double squared = (away_ + width_) * (away_ + width_);
  region_ = region_within(squared);
  if (squared < limit && !contains(region_, level_.bounds)) {
    upto_ = key_limit(squared);
    return true;
  }
  upto_ = last;
  region_ = region_within(limit);
  return true;
}

void NearCandidates::collect(const Brick& brick, const KeyRange& cells, const Vec3d& point, float above, float upto,
                             Work& work) {
  const GridNear near = near_of(brick, point, above, upto);
  const GridRows rows = rows_of(brick, cells);
  work.cells += rows.count;
  if (rows.count != 0) collect_rows(*brick.sorted, brick.number, rows, near);
  if (brick.recent_count != 0) collect_recent(brick, near, work);
}

void NearCandidates::collect_recent(const Brick& brick, const GridNear& near, Work& work) {
  const GridKernels& kernels = active_grid_kernels();
  const auto source = static_cast<uint32_t>(sources_.size());
  sources_.push_back({brick.recent.get(), brick.number});
  float keys[GridRows::kMaxValues + GridBlock::kLanes];
  size_t next = 0;
  const auto cull = [&](const GridRows& rows, uint32_t* slots) {
    next = 0;
    return kernels.collect_near(rows, near, slots, keys);
  };
  Work collected;  // its tests are counted when they are made
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
  const auto source = static_cast<uint32_t>(sources_.size() - 1);
  const size_t before = candidates_.size();
  candidates_.resize(before + count);
  for (uint32_t i = 0; i < count; ++i) {
    candidates_[before + i] = {keys[i], slots[i], source};
    sources_[source].block->prefetch_entry(slots[i]);
  }
}

void NearCandidates::sort() {
  const auto count = static_cast<uint32_t>(candidates_.size());
  if (count > kMaxSorted) {
    std::sort(candidates_.begin(), candidates_.end(),
              [](const Candidate& a, const Candidate& b) { return a.key < b.key; });
    return;
  }
  // By the bits of the keys, which are not negative; the lowest make room for the candidate's number.
  int32_t numbers[kMaxSorted];
  Candidate given[kMaxSorted];
  for (uint32_t i = 0; i < count; ++i) {
    given[i] = candidates_[i];
    numbers[i] = (std::bit_cast<int32_t>(given[i].key) & ~kNumberBits) | static_cast<int32_t>(i);
  }
  active_grid_kernels().sort_few(numbers, count);
  for (uint32_t i = 0; i < count; ++i) {
    candidates_[i] = given[numbers[i] & kNumberBits];
    candidates_[i].key = std::bit_cast<float>(numbers[i] & ~kNumberBits);
  }
}

}  // namespace locus::internal
