// The binary tree over boxes that wide trees are made from, with leaves of up to kBvhLeafSize. Equal references and
// options give an equal tree, whatever BvhOptions::parallel_for makes of the pieces of work. Internal to this folder.
#ifndef LOCUS_CORE_INDEX_BVH_BINARY_TREE_H_
#define LOCUS_CORE_INDEX_BVH_BINARY_TREE_H_

#include <array>
#include <deque>
#include <memory>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/index/bvh/box_reference.h"
#include "core/index/bvh/bvh_build.h"
#include "core/index/bvh/wide_choice.h"

namespace locus {

template <class S>
struct BinaryNode {
  Aabb<S> bounds;
  uint32_t first = 0, count = 0;   // of the references, in the tree's order
  BinaryNode* children = nullptr;  // left and right, side by side; null: a leaf
  WideChoice choice;

  bool is_leaf() const { return children == nullptr; }
};

// Nodes and references stay where they are while the tree stands, moved or not.
template <class S>
class BinaryTree {
 public:
  // Takes `count` references, at least one. CANCELLED when told to stop.
  static absl::StatusOr<BinaryTree> build(std::unique_ptr<BoxReference<S>[]> references, uint32_t count,
                                          const BvhOptions& options);

  const BinaryNode<S>& root() const { return nodes_.front().front()[0]; }
  // Of the value at a position of the tree's order.
  uint32_t index(uint32_t position) const { return references_[position].index(); }

 private:
  template <class>
  friend class BinaryBuilder;

  using Nodes = std::deque<std::array<BinaryNode<S>, 2>>;

  std::unique_ptr<BoxReference<S>[]> references_;
  // Those of the top, the root first, and of each subtree that was built in one go; children behind their parents.
  std::deque<Nodes> nodes_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BINARY_TREE_H_
