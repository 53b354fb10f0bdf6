// How the tree over a mesh's triangles lies in memory: wide nodes and blocks of triangles, each number of the eight
// side by side, so that one vector instruction meets all of them. Plain data that knows no other header of ours but
// these, since the kernels of every instruction set include it.
#ifndef LOCUS_CORE_INDEX_BVH_TRIANGLE_TREE_H_
#define LOCUS_CORE_INDEX_BVH_TRIANGLE_TREE_H_

#include <cstdint>

namespace locus {

inline constexpr int kTreeWidth = 8;  // children of a node, triangles of a block
// Nodes a visit may have waiting: every level leaves at most all but one of its children; eight more may be written
// behind the last.
inline constexpr int kTreeStack = 64 * (kTreeWidth - 1) + 1 + kTreeWidth;

// What a child slot refers to: a block where this bit is set, else a node.
inline constexpr uint32_t kBlockBit = 0x80000000u;
inline constexpr uint32_t kNoChild = 0xFFFFFFFFu;

// Children stand by rising surface area. Slots without a child hold kNoChild and a box that nothing meets.
struct alignas(64) TriangleNode {
  float bounds[6][kTreeWidth];  // min x, y, z, max x, y, z
  uint32_t child[kTreeWidth];
  // For each octant of directions (bit k: component k is negative) the slots from far to near, three bits each, the
  // farthest in the lowest; slots without a child come first.
  uint32_t order[kTreeWidth];
};
static_assert(sizeof(TriangleNode) == 256);

// Up to eight triangles; the places behind the last repeat it. Three vertices each, never a vertex and two edges.
struct alignas(64) TriangleBlock {
  float vertices[9][kTreeWidth];  // a.x, a.y, a.z, b.x ... c.z
  uint32_t first;                 // position of the first triangle in storage order
  uint32_t count;                 // 1 to 8
  float extent;                   // the longest side of the box around all of them, rounded up
  uint32_t unused[5];
};
static_assert(sizeof(TriangleBlock) == 320);

// The triangles below a node, by their positions in storage order.
struct NodeRange {
  uint32_t first;
  uint32_t count;
};

// A whole tree, borrowed. Node 0 is the root; nodes, blocks and triangles stand in depth-first order: of the children
// of a node first the blocks, then the nodes, each by slot.
struct TriangleTree {
  const TriangleNode* nodes;
  const NodeRange* ranges;  // by node
  const TriangleBlock* blocks;
  const uint32_t* numbers;  // by position: the triangle's number in the uploaded index list
  float magnitude;          // the largest |coordinate| of any vertex
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TRIANGLE_TREE_H_
