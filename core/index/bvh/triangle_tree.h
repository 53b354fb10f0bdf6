// Memory layout of the tree over a mesh's triangles: nodes of eight boxes and blocks of eight triangles, stored as
// structures of arrays, so that one vector instruction processes one coordinate of all eight boxes or triangles. Plain
// data. This header includes no other header of locus, because the kernels of every instruction set include it.
#ifndef LOCUS_CORE_INDEX_BVH_TRIANGLE_TREE_H_
#define LOCUS_CORE_INDEX_BVH_TRIANGLE_TREE_H_

#include <cstdint>

namespace locus {

inline constexpr int kTreeWidth = 8;  // maximum number of children of a node, and of triangles in a block
// Length of a visit's stack. On each of at most 64 levels one child is being visited and up to kTreeWidth - 1 children
// are pending; on the last level up to kTreeWidth children are pending. Vector code may write kTreeWidth elements
// beyond the last pending child.
inline constexpr int kTreeStack = 64 * (kTreeWidth - 1) + 1 + kTreeWidth;

// Length of the array of blocks that a visit of a half line collects before it tests their triangles.
inline constexpr uint32_t kMaxLineBlocks = 64;

// Bit of TriangleNode::child that is set if the child is a block and clear if it is a node. The other bits are the
// index of the block or node.
inline constexpr uint32_t kBlockBit = 0x80000000u;
// Value of TriangleNode::child in an unused slot. It includes kBlockBit, so test for kNoChild first.
inline constexpr uint32_t kNoChild = 0xFFFFFFFFu;

// One node. A build stores children in order of increasing surface area; a restored tree stores them in the order of
// its topology. Used slots are contiguous from slot 0 on; unused slots hold kNoChild and a box that no test hits.
struct alignas(64) TriangleNode {
  float bounds[6][kTreeWidth];  // rows: min x, y, z and max x, y, z; one column for each slot
  uint32_t child[kTreeWidth];
  // Slots from far to near, for each octant of ray directions (bit k of the octant is set if component k of the
  // direction is negative): three bits per slot, the farthest slot in the lowest bits. Unused slots count as farthest.
  uint32_t order[kTreeWidth];
};
static_assert(sizeof(TriangleNode) == 256);

// Leaf of up to eight triangles; unused lanes repeat the last triangle. A block stores three vertices of each triangle,
// never a vertex and two edges: vertex + edge, rounded to float, can differ from the other vertex, which would leave
// gaps between neighbouring triangles.
struct alignas(64) TriangleBlock {
  float vertices[9][kTreeWidth];  // rows: a.x, a.y, a.z, b.x ... c.z; one column for each triangle
  uint32_t first;                 // storage position of the first triangle
  uint32_t count;                 // number of triangles, 1 to 8
  float extent;                   // longest side of the box around the triangles, rounded up
  uint32_t unused[5];
};
static_assert(sizeof(TriangleBlock) == 320);

// Range of storage positions of the triangles below a node.
struct NodeRange {
  uint32_t first;
  uint32_t count;
};

// View of a whole tree; borrows the arrays of the tree. Node 0 is the root. Nodes, blocks and triangles are stored in
// depth-first order. After a node come its child blocks, in order of slots, and then its child nodes, in order of
// slots. Each child node is followed by everything below it before the next child node.
struct TriangleTree {
  const TriangleNode* nodes;
  const NodeRange* ranges;  // range of the triangles below each node, indexed by node
  const TriangleBlock* blocks;
  const uint32_t* numbers;  // for each storage position, the triangle's number in the uploaded index list
  float magnitude;          // largest |coordinate| of any vertex
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TRIANGLE_TREE_H_
