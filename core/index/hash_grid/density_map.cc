#include "core/index/hash_grid/density_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

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

void DensityCount::Node::add_child(const GridKey& key, double child_values) {
  values += child_values;
  max_of_child = std::max(max_of_child, child_values);
  const uint64_t child = uint64_t{1} << index_in_brick(key);
  children |= child;
  nodes |= child;
}

bool DensityCount::Node::is_dense(double min_brick_values) const {
  return has_dense_child || values >= min_brick_values * std::popcount(children) ||
         max_of_child >= kCrowd * min_brick_values;
}

DensityCount::DensityCount(int base_exponent, const Aabbd& bounds)
    : base_(base_exponent), top_(base_exponent), counts_(1) {
  const double width = bounds.empty() ? 0 : max_component(bounds.max - bounds.min);
  while (top_ + kStep <= kMaxBaseExponent && std::ldexp(1.0, top_ + kBrickBits) < width) {
    top_ += kStep;
    counts_.emplace_back();
  }
}

void DensityCount::add(const Brick& brick) {
  const BrickGeometry& geometry = brick.geometry;
  LOCUS_DCHECK_GE(geometry.exponent, base_);
  const int levels = (geometry.exponent - base_ + kStep - 1) / kStep;  // of the node that counts the values
  const int exponent = base_ + levels * kStep;
  if (exponent > top_) return;
  const int finer = exponent - geometry.exponent;  // 0 or 1: the brick is so much finer than the node
  LOCUS_DCHECK(0 <= finer && finer < kStep);
  Node& node = counts_[static_cast<size_t>(levels)][ancestor(geometry.key, finer)];
  node.values += brick.size();
  if (levels == 0) return;
  std::array<uint32_t, kBrickCells> values{};  // of each child of the node, which is as wide as a cell of the node
  const auto child_of = [&](int cell) {
    GridKey child;
    for (int axis = 0; axis < 3; ++axis)
      child[axis] = ((geometry.key[axis] << kBrickBits) + (cell >> (axis * kBrickBits) & 3)) >> finer;
    return static_cast<size_t>(index_in_brick(child));
  };
  const std::array<uint32_t, kBrickCells + 1>& offsets = brick.sorted->offsets();
  for (int cell = 0; cell < kBrickCells; ++cell)
    values[child_of(cell)] += offsets[static_cast<size_t>(cell) + 1] - offsets[static_cast<size_t>(cell)];
  for (uint32_t slot = 0; slot < brick.recent_count; ++slot)
    if (!brick.is_recent_dead(slot)) ++values[child_of(geometry.cell_of(brick.recent->entry(slot).position))];
  for (size_t child = 0; child < values.size(); ++child)
    if (values[child] != 0) node.children |= uint64_t{1} << child;
  node.max_of_child = std::max(node.max_of_child, static_cast<double>(*std::max_element(values.begin(), values.end())));
}

void DensityCount::add(Vec3d position, double values) {
  counts_[0][brick_of(internal::cell_of(position, cells_per_unit(base_)))].values += values;
}

DensityMap DensityCount::map(double min_brick_values, const DensityMap* before) {
  DensityMap result(base_);
  const bool was_sparse = before != nullptr && before->has_sparse_regions();
  size_t sparse_nodes = 0,
         coarse_cells = 0;  // coarse_cells: cells above the finest nodes with values but without nodes
  for (size_t level = 0; level < counts_.size(); ++level) {
    const int exponent = base_ + kStep * static_cast<int>(level);
    DensityMap::Nodes dense;
    for (const auto& [key, node] : counts_[level]) {
      const bool was_dense = level != 0 && was_sparse && before->is_dense(key, exponent);
      const bool is_dense = level != 0 && node.is_dense(was_dense ? min_brick_values / 2 : min_brick_values);
      if (is_dense) dense.insert(key);
      if (!is_dense && level == 1) ++sparse_nodes;
      if (level > 1) coarse_cells += static_cast<size_t>(std::popcount(node.children & ~node.nodes));
      if (level + 1 == counts_.size()) continue;
      Node& parent = counts_[level + 1][ancestor(key, kStep)];
      parent.add_child(key, node.values);
      parent.has_dense_child |= is_dense;
    }
    if (level != 0) result.dense_.push_back(std::move(dense));
  }
  const double share = kMinSparseShare * (was_sparse ? 0.5 : 1);
  if (counts_.size() < 2) return DensityMap(base_);
  const auto finest = static_cast<double>(counts_[1].size() + coarse_cells);
  if (static_cast<double>(sparse_nodes + coarse_cells) <= share * finest) return DensityMap(base_);
  result.top_ = top_;
  return result;
}

}  // namespace locus::internal
