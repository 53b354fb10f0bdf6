// Code shared by the tracing of single rays and of packets (eight coherent rays traced together): the table of the rows
// of a node's bounds, and the choice between hits.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_ANSWER_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_ANSWER_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/ray_kernels.h"

namespace locus {
namespace {

constexpr uint32_t kNoNumber = 0xFFFFFFFFu;

// Table of rows of TriangleNode::bounds. The octant of a ray's direction and an axis select two rows: those with the
// planes through which the ray enters and leaves the boxes. A row is given by the offset of its first float in
// `bounds`.
struct RowTable {
  uint32_t entered[8][4] = {}, left[8][4] = {};
  constexpr RowTable() {
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

// Returns the triangle number of the triangle in lane `lane` of `block`.
static inline uint32_t number_of(const TriangleTree& tree, const TriangleBlock& block, int lane) {
  return tree.numbers[block.first + static_cast<uint32_t>(lane)];
}

// Returns whether the hit (t, number) replaces the ray's best hit so far, because the new hit is nearer, or equally
// near with a lower triangle number. If `found` is true, the best hit so far is (limit, best); otherwise the ray has no
// hit yet, and `limit` is KernelRay::limit.
static inline bool is_better(float t, uint32_t number, float limit, bool found, uint32_t best) {
  if (t > limit || (planted(PlantedBug::kKernelLimit) && !found && t == limit)) return false;
  return !found || t < limit || (number >= best) == planted(PlantedBug::kKernelTie);
}

// Buffer of at most `max_rows` hits of one ray: the lowest hits so far by (t, triangle number).
struct KeptRows {
  KernelRow* rows;  // if max_rows rows are stored, the highest row is first
  uint32_t max_rows;

  static inline bool is_lower(const KernelRow& a, const KernelRow& b) {
    if (planted(PlantedBug::kKernelRowTie)) return a.t < b.t;
    return a.t < b.t || (a.t == b.t && a.number < b.number);
  }

  // Stores a hit if it is among the lowest max_rows hits so far. `count` is the number of stored rows. While `count`
  // is less than max_rows, each stored hit increments `count`; after that, each stored hit replaces the highest row.
  // Once max_rows rows are stored, sets `limit` to the t of the highest row.
  inline void offer(const KernelRow& row, uint32_t& count, float& limit) const {
    if (row.t > limit) return;
    if (count < max_rows)
      rows[count++] = row;
    else if (is_lower(row, rows[0]))
      rows[0] = row;
    else
      return;
    if (count < max_rows) return;
    for (uint32_t i = 1; i < max_rows; ++i) {
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
