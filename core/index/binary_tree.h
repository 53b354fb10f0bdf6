// Binary tree over boxes with leaves of up to kBvhLeafSize boxes: the intermediate result of a build. A bvh collapses
// the tree to nodes of up to eight children; a sphere tree replaces its boxes by balls. Equal references and options
// result in an equal tree; the threads and the order in which BvhOptions::parallel_for runs the tasks have no effect.
// Immutable after build(). Invariants: the two children of a node partition its references (BoxReference); a node's
// bounds are exactly the box around its references. Internal to core/index.
#ifndef LOCUS_CORE_INDEX_BINARY_TREE_H_
#define LOCUS_CORE_INDEX_BINARY_TREE_H_

#include <array>
#include <deque>
#include <memory>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/index/box_reference.h"
#include "core/index/tree_build.h"
#include "core/index/wide_choice.h"

namespace locus {

template <class S>
struct BinaryNode {
  Aabb<S> bounds;
  uint32_t first = 0, count = 0;   // range of the node's references in the tree's order
  BinaryNode* children = nullptr;  // left and right child, adjacent; null for a leaf
  WideChoice choice;

  bool is_leaf() const { return children == nullptr; }
};

// Owner of the nodes and the reordered references. The addresses of nodes and references stay valid when the tree is
// moved.
template <class S>
class BinaryTree {
 public:
  // Builds a tree of the `count` elements of `references` and reorders these elements. Precondition: count >= 1.
  // Returns CANCELLED if the cancel flag was set.
  static absl::StatusOr<BinaryTree> build(std::unique_ptr<BoxReference<S>[]> references, uint32_t count,
                                          const BvhOptions& options);

  const BinaryNode<S>& root() const { return nodes_.front().front()[0]; }
  // Returns the input index of the value at `position` in the tree's order.
  uint32_t index(uint32_t position) const { return references_[position].index(); }

 private:
  template <class>
  friend class BinaryBuilder;

  using Nodes = std::deque<std::array<BinaryNode<S>, 2>>;

  std::unique_ptr<BoxReference<S>[]> references_;
  // The first element holds the nodes of the top of the tree, beginning with the root; each other element holds the
  // nodes of one subtree that was built as one task. Within an element, children follow their parents.
  std::deque<Nodes> nodes_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BINARY_TREE_H_
