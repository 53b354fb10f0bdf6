// Turns a binary tree over triangles into the nodes and blocks that TriangleBvh serves: children by rising area,
// everything depth-first, blocks before nodes. Pieces of the tree are written by many threads to where a count has told
// that they go. Internal to this folder.
#ifndef LOCUS_CORE_INDEX_BVH_TRIANGLE_WRITER_H_
#define LOCUS_CORE_INDEX_BVH_TRIANGLE_WRITER_H_

#include <memory>
#include <vector>

#include "core/base/large_array.h"
#include "core/geometry/triangle.h"
#include "core/index/bvh/binary_tree.h"
#include "core/index/bvh/triangle_tree.h"
#include "core/index/bvh/wide_children.h"

namespace locus {

// The arrays behind a TriangleTree, of exactly the length needed.
struct TriangleArrays {
  LargeArray<TriangleNode> nodes;
  LargeArray<NodeRange> ranges;
  LargeArray<TriangleBlock> blocks;
  LargeArray<uint32_t> numbers;
  uint32_t node_count = 0, block_count = 0, triangle_count = 0;
  uint32_t depth = 0;  // levels of nodes
};

class TriangleWriter {
 public:
  TriangleWriter(absl::Span<const Triangle> triangles, const BinaryTree<float>& tree, const BvhOptions& options)
      : triangles_(triangles), tree_(tree), options_(options) {}

  // Incomplete once the build is cancelled.
  TriangleArrays write();

 private:
  // Where something goes, or how much there is.
  struct Place {
    uint32_t node = 0, block = 0, position = 0;
  };
  // What is written in one go: a single node, or all that lies below one.
  struct Piece {
    const BinaryNode<float>* root;
    bool whole;
    uint32_t parent, slot;  // the piece that is its parent, and which child of it
    uint32_t depth;         // levels of nodes down to its root
    Place start;
  };
  // A child that waits for its turn.
  struct Waiting {
    const BinaryNode<float>* node;
    uint32_t parent, slot;
    uint32_t depth;
  };

  static void push_children(const WideChildren<float>& children, uint32_t parent, uint32_t depth,
                            std::vector<Waiting>& waiting);
  std::vector<Piece> cut() const;
  bool is_block(const Piece& piece) const;
  // Deepens the piece's depth to that of its deepest node.
  Place count(Piece& piece) const;
  void write_top(const std::vector<Piece>& pieces);
  void write_whole(const Piece& piece);
  void write_node(const WideChildren<float>& children, NodeRange range, uint32_t number);
  void write_block(const BinaryNode<float>& leaf, const Place& place);

  const absl::Span<const Triangle> triangles_;
  const BinaryTree<float>& tree_;
  const BvhOptions& options_;
  TriangleArrays arrays_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TRIANGLE_WRITER_H_
