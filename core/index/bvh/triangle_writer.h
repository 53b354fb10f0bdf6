// Converts a binary tree over triangles to the nodes and blocks of a TriangleBvh. The children of a node are in order
// of increasing area; nodes and blocks are stored depth-first, the blocks of a node before its child nodes. The writer
// divides the tree into chunks: each node near the root is a chunk, and so is each whole subtree below these nodes. A
// first pass counts the nodes, blocks and triangles of each chunk. The counts determine where each chunk begins in the
// output arrays. A second pass writes the chunks. Both passes process subtrees in parallel. Internal to this folder.
#ifndef LOCUS_CORE_INDEX_BVH_TRIANGLE_WRITER_H_
#define LOCUS_CORE_INDEX_BVH_TRIANGLE_WRITER_H_

#include <memory>
#include <vector>

#include "core/base/large_array.h"
#include "core/geometry/triangle.h"
#include "core/index/binary_tree.h"
#include "core/index/bvh/triangle_tree.h"
#include "core/index/bvh/wide_children.h"

namespace locus {

// Owner of the arrays of a TriangleTree.
struct TriangleArrays {
  LargeArray<TriangleNode> nodes;
  LargeArray<NodeRange> ranges;
  LargeArray<TriangleBlock> blocks;
  LargeArray<uint32_t> numbers;
  uint32_t node_count = 0, block_count = 0, triangle_count = 0;
  uint32_t depth = 0;  // number of levels of nodes
};

// Writer of one tree. Borrows the constructor's arguments. write() must be called only once.
class TriangleWriter {
 public:
  TriangleWriter(absl::Span<const Triangle> triangles, const BinaryTree<float>& tree, const BvhOptions& options)
      : triangles_(triangles), tree_(tree), options_(options) {}

  // Writes the tree and returns its arrays, whose contents are incomplete if the build was cancelled.
  TriangleArrays write();

 private:
  // Indices of the next element in the arrays `nodes`, `blocks` and `numbers` of TriangleArrays. In the result of
  // count(), the members are the numbers of nodes, blocks and triangles of a chunk.
  struct Offsets {
    uint32_t node = 0, block = 0, position = 0;
  };
  // Unit of work: either a single node near the root, with too many triangles below it for one chunk, or a whole
  // subtree.
  struct Chunk {
    const BinaryNode<float>* root;
    bool is_subtree;
    uint32_t parent, slot;  // index of the parent's chunk, and slot in the parent
    uint32_t depth;  // number of levels from the tree's root to the chunk's root; after count(), to the deepest node
    Offsets start;
  };
  // Child of a wide node that was not visited yet. In split_into_chunks(), `parent` is the index of the chunk that
  // contains the parent; in write_subtree(), `parent` is the index of the parent in TriangleArrays::nodes.
  struct Pending {
    const BinaryNode<float>* node;
    uint32_t parent, slot;
    uint32_t depth;
  };

  static void push_children(const WideChildren<float>& children, uint32_t parent, uint32_t depth,
                            std::vector<Pending>& pending);
  std::vector<Chunk> split_into_chunks() const;
  bool is_block(const Chunk& chunk) const;
  // Returns the numbers of nodes, blocks and triangles written for a chunk; a single node counts without its children.
  // For a subtree, raises chunk.depth to the depth of the deepest node.
  Offsets count(Chunk& chunk) const;
  void write_top(const std::vector<Chunk>& chunks);
  void write_subtree(const Chunk& chunk);
  void write_node(const WideChildren<float>& children, NodeRange range, uint32_t index);
  void write_block(const BinaryNode<float>& leaf, const Offsets& offsets);

  const absl::Span<const Triangle> triangles_;
  const BinaryTree<float>& tree_;
  const BvhOptions& options_;
  TriangleArrays arrays_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TRIANGLE_WRITER_H_
