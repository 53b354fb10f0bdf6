#include "core/index/hash_grid/brick.h"

#include <bit>
#include <cmath>

#include "core/base/check.h"

namespace locus::internal {

BrickGeometry BrickGeometry::of(const GridKey& key, int exponent) {
  LOCUS_DCHECK_GE(exponent, kMinCellExponent);
  LOCUS_DCHECK_LE(exponent, kMaxCellExponent);
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

bool BrickGeometry::nearly_holds(Vec3d position) const {
  return contains(grown(Aabbd{low, high}, 0x1p-40 * (max_component(abs(center)) + edge)), position);
}

bool BrickGeometry::cell_nearly_holds(int cell, Vec3d position) const {
  constexpr int kMask = (1 << kBrickBits) - 1;
  const double cell_edge = edge / (1 << kBrickBits);
  const Vec3d index{static_cast<double>(cell & kMask), static_cast<double>(cell >> kBrickBits & kMask),
                    static_cast<double>(cell >> (2 * kBrickBits))};
  const Vec3d cell_low = low + index * cell_edge;
  const Aabbd box{cell_low, cell_low + Vec3d{1, 1, 1} * cell_edge};
  return contains(grown(box, 0x1p-40 * (max_component(abs(center)) + edge)), position);
}

void Brick::check_invariants() const {
  LOCUS_DCHECK(sorted != nullptr);
  LOCUS_DCHECK_EQ(recent == nullptr, recent_count == 0);
  LOCUS_DCHECK_LE(recent_count, kMaxRecent);
  if (recent != nullptr) LOCUS_DCHECK_LE(recent_count, recent->count());
  LOCUS_DCHECK_LE(recent_dead_count, recent_count);
  LOCUS_DCHECK_LE(dead_count, sorted->count());
  LOCUS_DCHECK(dead.empty() || dead.size() * 64 >= size_t{sorted->count()} + 64);
  const auto count_bits = [](const auto& words) {
    uint32_t bits = 0;
    for (const uint64_t word : words) bits += static_cast<uint32_t>(std::popcount(word));
    return bits;
  };
  LOCUS_DCHECK_EQ(count_bits(dead), dead_count);
  LOCUS_DCHECK_EQ(count_bits(recent_dead), recent_dead_count);
  LOCUS_DCHECK_GT(size(), 0u);
  LOCUS_DCHECK_GE(max_extent, 0.0f);
}

}  // namespace locus::internal
