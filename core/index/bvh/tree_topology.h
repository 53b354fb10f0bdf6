// Topology of a triangle tree: which triangles form a block, and which blocks and nodes are the children of a node. A
// topology holds no coordinates and takes about five bytes per triangle. restore_arrays() restores the tree from its
// topology in a fraction of the time of a build; the result equals the original tree byte for byte, except for the
// signs of zeros in boxes. Boxes are computed from the triangles themselves, so any topology that fits the mesh results
// in correct answers; a bad topology only makes queries slow.
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

// Kinds of the children of one node. Bit k of `blocks` is set if slot k holds a block, bit k of `nodes` if slot k holds
// a node. Used slots are contiguous from slot 0 on.
struct TopologyNode {
  uint8_t blocks = 0;
  uint8_t nodes = 0;

  friend bool operator==(const TopologyNode&, const TopologyNode&) = default;
};

// Topology of a whole tree, in the order of a TriangleTree: depth-first, the blocks of a node before the nodes below
// it.
struct TreeTopology {
  absl::Span<const uint32_t> numbers;  // triangle number at each storage position; borrowed
  std::vector<uint8_t> block_sizes;    // number of triangles of each block, 1 to kTreeWidth
  std::vector<TopologyNode> nodes;
};

// Returns the topology of the tree in `arrays`. Precondition: the tree is not empty. Borrows the triangle numbers from
// `arrays`.
TreeTopology topology_of(const TriangleArrays& arrays);

// Restores the tree that `topology` describes. Calls triangle(number) once for each number below `triangle_count`, on
// any threads; the returned vertices must be finite. Errors: INVALID_ARGUMENT if `topology` does not describe a tree of
// `triangle_count` triangles within the depth limit; CANCELLED if the cancel flag of `options` was set. O(n).
absl::StatusOr<TriangleArrays> restore_arrays(const TreeTopology& topology, uint32_t triangle_count,
                                              absl::FunctionRef<Triangle(uint32_t)> triangle,
                                              const BvhOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TREE_TOPOLOGY_H_
