#include "core/index/hash_grid/density_map.h"

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

void DensityCount::add(const GridKey& key, int exponent, double values) {
  LOCUS_DCHECK_GE(exponent, base_);
  const int levels = std::max((exponent - base_ + kStep - 1) / kStep, 1);  // of the node that counts the values
  const int node = base_ + levels * kStep;
  if (node <= top_) counts_[static_cast<size_t>(levels - 1)][ancestor(key, node - exponent)] += values;
}

void DensityCount::add(Vec3d position, double values) {
  add(brick_of(internal::cell_of(position, cells_per_unit(base_))), base_, values);
}

DensityMap DensityCount::map(size_t dense_values, const DensityMap* before) {
  DensityMap result(base_);
  const bool was_sparse = before != nullptr && before->has_sparse_regions();
  const auto enough = static_cast<double>(dense_values);
  size_t sparse_nodes = 0;
  for (size_t level = 0; level < counts_.size(); ++level) {
    DensityMap::Nodes& dense = result.dense_.emplace_back();
    const int exponent = base_ + kStep * static_cast<int>(level + 1);
    for (const auto& [key, values] : counts_[level]) {
      if (level + 1 < counts_.size()) counts_[level + 1][ancestor(key, kStep)] += values;
      const bool was_dense = was_sparse && before->is_dense(key, exponent);
      if (values >= (was_dense ? enough / 2 : enough)) {
        dense.insert(key);
      } else if (level == 0) {
        ++sparse_nodes;
      }
    }
  }
  const double share = kMinSparseShare * (was_sparse ? 0.5 : 1);
  if (counts_.empty() || static_cast<double>(sparse_nodes) <= share * static_cast<double>(counts_[0].size()))
    return DensityMap(base_);
  result.top_ = top_;
  return result;
}

DensityMap density_of(const EvenSample& sample, int base_exponent, size_t dense_values) {
  LOCUS_CHECK(!sample.values().empty());
  Aabbd bounds;
  for (const SampledValue& value : sample.values()) bounds = merge(bounds, Aabbd{value.position, value.position});
  DensityCount count(base_exponent, bounds);
  for (const SampledValue& value : sample.values()) count.add(value.position, static_cast<double>(sample.stride()));
  return count.map(dense_values, nullptr);
}

}  // namespace locus::internal
