// Memory layout of the tree over a mesh's triangles: nodes of eight boxes and blocks of eight triangles, stored as
// structures of arrays, so that one vector instruction processes a coordinate of all eight. Plain data. This header
// includes no other header of locus, because the kernels of every instruction set include it.
#ifndef LOCUS_CORE_INDEX_BVH_TRIANGLE_TREE_H_
#define LOCUS_CORE_INDEX_BVH_TRIANGLE_TREE_H_

#include <cstdint>

namespace locus {

inline constexpr int kTreeWidth = 8;  // children of a node, triangles of a block
// Length of the stack of a visit: each level leaves at most all but one of its children pending, and vector code may
// write eight entries beyond the last one.
inline constexpr int kTreeStack = 64 * (kTreeWidth - 1) + 1 + kTreeWidth;

// A child slot refers to a block if this bit is set, else to a node.
inline constexpr uint32_t kBlockBit = 0x80000000u;
// Content of an unused child slot.
inline constexpr uint32_t kNoChild = 0xFFFFFFFFu;

// One node. A build stores children in order of increasing surface area; a restored tree stores them in the order of
// its topology. Used slots are contiguous from slot 0 on; unused slots hold kNoChild and a box that no test hits.
struct alignas(64) TriangleNode {
  float bounds[6][kTreeWidth];  // min x, y, z, max x, y, z
  uint32_t child[kTreeWidth];
  // For each octant of directions (bit k is set if component k is negative): the slots in order from far to near, three
  // bits each, the farthest one in the lowest bits. Unused slots come first.
  uint32_t order[kTreeWidth];
};
static_assert(sizeof(TriangleNode) == 256);

// Leaf of up to eight triangles; unused lanes repeat the last triangle. It stores three vertices of each triangle,
// never a vertex and two edges: vertex + edge is not the exact other vertex in float, which would leave gaps between
// neighbouring triangles.
struct alignas(64) TriangleBlock {
  float vertices[9][kTreeWidth];  // a.x, a.y, a.z, b.x ... c.z
  uint32_t first;                 // storage position of the first triangle
  uint32_t count;                 // 1 to 8
  float extent;                   // longest side of the box around all of them, rounded up
  uint32_t unused[5];
};
static_assert(sizeof(TriangleBlock) == 320);

// Range of storage positions of the triangles below a node.
struct NodeRange {
  uint32_t first;
  uint32_t count;
};

// A whole tree, borrowed. Node 0 is the root. Nodes, blocks and triangles are stored in depth-first order: for each
// node first the blocks among its children, then the child nodes with everything below them, each in order of slots.
struct TriangleTree {
  const TriangleNode* nodes;
  const NodeRange* ranges;  // by node
  const TriangleBlock* blocks;
  const uint32_t* numbers;  // by storage position: the triangle's number in the uploaded index list
  float magnitude;          // largest |coordinate| of any vertex
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TRIANGLE_TREE_H_
