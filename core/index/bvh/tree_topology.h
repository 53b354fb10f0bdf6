// What a build has found out about a mesh, without one coordinate: which triangles share a block, and which blocks and
// nodes a node. Five bytes a triangle that give the same tree again in a fraction of the time, to the byte but for the
// signs of zeros in boxes, and that can be wrong without harm: boxes are made from the triangles themselves, so
// whatever an outline says, a tree that is restored from it answers right. A bad one only makes it slow.
//
// Plain data; free functions, any thread.
#ifndef LOCUS_CORE_INDEX_BVH_TREE_TOPOLOGY_H_
#define LOCUS_CORE_INDEX_BVH_TREE_TOPOLOGY_H_

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/geometry/triangle.h"
#include "core/index/bvh/bvh_build.h"
#include "core/index/bvh/triangle_tree.h"
#include "core/index/bvh/triangle_writer.h"

namespace locus {

// Bit k of each: whether slot k holds a block, or a node. Slots are in use from the first on without a gap.
struct NodeOutline {
  uint8_t blocks = 0;
  uint8_t nodes = 0;

  friend bool operator==(const NodeOutline&, const NodeOutline&) = default;
};

// All in the order of a TriangleTree: depth-first, the blocks of a node before the nodes below it.
struct TreeTopology {
  absl::Span<const uint32_t> numbers;  // of the triangles, by position; borrowed
  std::vector<uint8_t> block_sizes;    // 1 to kTreeWidth
  std::vector<NodeOutline> nodes;
};

// Of a tree that is not empty. Borrows from it.
TreeTopology outline_of(const TriangleArrays& arrays);

// Of `triangle_count` triangles, each number from 0 on asked for once, on any threads. INVALID_ARGUMENT for an outline
// that is none of so many triangles, CANCELLED. O(n).
absl::StatusOr<TriangleArrays> restore_arrays(const TreeTopology& topology, uint32_t triangle_count,
                                              absl::FunctionRef<Triangle(uint32_t)> triangle,
                                              const BvhOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TREE_TOPOLOGY_H_
