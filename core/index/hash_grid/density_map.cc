#include "core/index/hash_grid/density_map.h"

#include <bit>

#include "core/base/check.h"

namespace locus::internal {
namespace {

constexpr int kStep = kBrickBits;  // difference of the exponents of two density levels

// Returns the key of the brick that contains the brick `key` of a level whose exponent is lower by `levels`.
GridKey ancestor(const GridKey& key, int levels) {
  LOCUS_DCHECK(0 <= levels && levels < 64);
  return {key.x >> levels, key.y >> levels, key.z >> levels};
}

}  // namespace

bool DensityMap::is_dense(const GridKey& key, int exponent) const {
  LOCUS_DCHECK_GT(exponent, base_);
  if (exponent > top_) return true;
  LOCUS_DCHECK_EQ((exponent - base_) % kStep, 0);
  return dense_[static_cast<size_t>((exponent - base_) / kStep - 1)].contains(key);
}

int DensityMap::exponent_at(Vec3d position) const {
  if (!has_sparse_regions()) return base_;
  GridKey key = brick_of(internal::cell_of(position, cells_per_unit(base_)));
  int exponent = base_;
  for (const Nodes& nodes : dense_) {
    key = ancestor(key, kStep);
    if (nodes.contains(key)) return exponent;
    exponent += kStep;
  }
  LOCUS_DCHECK_EQ(exponent, top_);
  return exponent;
}

bool DensityMap::differs(const DensityMap& before, const GridKey& key, int exponent) const {
  LOCUS_DCHECK_EQ(before.base_, base_);
  LOCUS_DCHECK_GE(exponent, base_);
  const int above = base_ + ((exponent - base_) / kStep + 1) * kStep;  // the next coarser density level
  if (above <= top_ && !is_dense(ancestor(key, above - exponent), above)) return true;
  if (exponent == base_ || above - exponent != kStep) return false;
  return is_dense(key, exponent) && !before.is_dense(key, exponent);
}

DensityCount::DensityCount(int base_exponent, const Aabbd& bounds) : base_(base_exponent), top_(base_exponent) {
  const double width = bounds.empty() ? 0 : max_component(bounds.max - bounds.min);
  while (top_ + kStep <= kMaxBaseExponent && std::ldexp(1.0, top_ + kBrickBits) < width) {
    top_ += kStep;
    counts_.emplace_back();
  }
}

void DensityCount::add(const Brick& brick) {
  const BrickGeometry& geometry = brick.geometry;
  LOCUS_DCHECK_GE(geometry.exponent, base_);
  const int levels =
      std::max((geometry.exponent - base_ + kStep - 1) / kStep, 1);  // of the node that counts the values
  const int exponent = base_ + levels * kStep;
  if (exponent > top_) return;
  const int finer = exponent - geometry.exponent;  // 0 to kStep: the brick is so much finer than the node
  LOCUS_DCHECK(0 <= finer && finer <= kStep);
  Node& node = counts_[static_cast<size_t>(levels - 1)][ancestor(geometry.key, finer)];
  node.values += brick.size();
  const auto add_child = [&](int64_t cell) {
    GridKey child;  // in units of the children, which are as wide as the cells of the node
    for (int axis = 0; axis < 3; ++axis)
      child[axis] = ((geometry.key[axis] << kBrickBits) + (cell >> (axis * kBrickBits) & 3)) >> finer;
    node.children |= uint64_t{1} << index_in_brick(child);
  };
  const std::array<uint32_t, kBrickCells + 1>& offsets = brick.sorted->offsets();
  for (int cell = 0; cell < kBrickCells; ++cell)
    if (offsets[static_cast<size_t>(cell)] != offsets[static_cast<size_t>(cell) + 1]) add_child(cell);
  for (uint32_t slot = 0; slot < brick.recent_count; ++slot)
    if (!brick.is_recent_dead(slot)) add_child(geometry.cell_of(brick.recent->entry(slot).position));
}

void DensityCount::add(Vec3d position, double values) {
  if (counts_.empty()) return;
  const GridKey child = brick_of(internal::cell_of(position, cells_per_unit(base_)));
  Node& node = counts_[0][ancestor(child, kStep)];
  node.values += values;
  node.children |= uint64_t{1} << index_in_brick(child);
}

DensityMap DensityCount::map(double min_brick_values, const DensityMap* before) {
  DensityMap result(base_);
  const bool was_sparse = before != nullptr && before->has_sparse_regions();
  size_t sparse_nodes = 0;
  for (size_t level = 0; level < counts_.size(); ++level) {
    DensityMap::Nodes& dense = result.dense_.emplace_back();
    const int exponent = base_ + kStep * static_cast<int>(level + 1);
    for (const auto& [key, node] : counts_[level]) {
      const bool was_dense = was_sparse && before->is_dense(key, exponent);
      const bool fills_bricks = node.values >= min_brick_values * (was_dense ? 0.5 : 1) * std::popcount(node.children);
      const bool is_dense = node.has_dense_child || fills_bricks;
      if (is_dense) dense.insert(key);
      if (!is_dense && level == 0) ++sparse_nodes;
      if (level + 1 == counts_.size()) continue;
      Node& parent = counts_[level + 1][ancestor(key, kStep)];
      parent.values += node.values;
      parent.children |= uint64_t{1} << index_in_brick(key);
      parent.has_dense_child |= is_dense;
    }
  }
  const double share = kMinSparseShare * (was_sparse ? 0.5 : 1);
  if (counts_.empty() || static_cast<double>(sparse_nodes) <= share * static_cast<double>(counts_[0].size()))
    return DensityMap(base_);
  result.top_ = top_;
  return result;
}

DensityMap density_of(const EvenSample& sample, int base_exponent, double min_brick_values) {
  LOCUS_CHECK(!sample.values().empty());
  Aabbd bounds;
  for (const SampledValue& value : sample.values()) bounds = merge(bounds, Aabbd{value.position, value.position});
  DensityCount count(base_exponent, bounds);
  for (const SampledValue& value : sample.values()) count.add(value.position, static_cast<double>(sample.stride()));
  return count.map(min_brick_values, nullptr);
}

}  // namespace locus::internal
