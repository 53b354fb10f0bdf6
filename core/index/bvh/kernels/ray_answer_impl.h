// What single rays and packets of rays have in common: the rows of a node by the way a ray goes, and which hits are the
// answer.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_ANSWER_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_ANSWER_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/ray_kernels.h"

namespace locus {
namespace {

constexpr uint32_t kNoNumber = 0xFFFFFFFFu;

// For each octant the rows of TriangleNode::bounds that a ray enters by, x, y, z, and those it leaves by: their first
// floats.
struct RowTable {
  uint32_t entered[8][4], left[8][4];
  constexpr RowTable() : entered(), left() {
    for (int octant = 0; octant < 8; ++octant) {
      for (int axis = 0; axis < 3; ++axis) {
        const int negative = octant >> axis & 1;
        entered[octant][axis] = static_cast<uint32_t>(kTreeWidth * (axis + 3 * negative));
        left[octant][axis] = static_cast<uint32_t>(kTreeWidth * (axis + 3 - 3 * negative));
      }
    }
  }
};
static constexpr RowTable kRows;

static inline uint32_t number_of(const TriangleTree& tree, const TriangleBlock& block, int place) {
  return tree.numbers[block.first + static_cast<uint32_t>(place)];
}

// Whether a hit is better than the best so far, which stands at the limit if anything was found.
static inline bool is_better(float t, uint32_t number, float limit, bool found, uint32_t best) {
  if (t > limit || (planted(PlantedBug::kKernelLimit) && !found && t == limit)) return false;
  return !found || t < limit || (number >= best) == planted(PlantedBug::kKernelTie);
}

// The lowest hits of one ray so far.
struct KeptRows {
  KernelRow* rows;  // where they are as many as wanted, the farthest stands first
  uint32_t most;

  static inline bool is_lower(const KernelRow& a, const KernelRow& b) {
    if (planted(PlantedBug::kKernelRowTie)) return a.t < b.t;
    return a.t < b.t || (a.t == b.t && a.number < b.number);
  }

  // `count`: how many there are. Lowers the limit once there are as many as wanted.
  inline void offer(const KernelRow& row, uint32_t& count, float& limit) const {
    if (row.t > limit) return;
    if (count < most)
      rows[count++] = row;
    else if (is_lower(row, rows[0]))
      rows[0] = row;
    else
      return;
    if (count < most) return;
    for (uint32_t i = 1; i < most; ++i) {
      if (!is_lower(rows[0], rows[i])) continue;
      const KernelRow farther = rows[i];
      rows[i] = rows[0];
      rows[0] = farther;
    }
    limit = rows[0].t;
  }
};

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_ANSWER_IMPL_H_
