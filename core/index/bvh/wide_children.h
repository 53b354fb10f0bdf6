// Children of one wide node (a node of up to eight children). The wide node replaces a part of the binary tree: a root
// node and some of the inner nodes below it, which WideChoice determines. The children of the wide node are the binary
// nodes directly below this part. Borrows the binary tree.
#ifndef LOCUS_CORE_INDEX_BVH_WIDE_CHILDREN_H_
#define LOCUS_CORE_INDEX_BVH_WIDE_CHILDREN_H_

#include <array>

#include "core/base/check.h"
#include "core/index/binary_tree.h"

namespace locus {

template <class S>
class WideChildren {
 public:
  // Collects the children of the wide node with the given `root`, from left to right. If `root` is a leaf, which
  // happens only if the whole tree is one leaf, the only child is `root` itself.
  explicit WideChildren(const BinaryNode<S>& root) {
    struct Pending {
      const BinaryNode<S>* node;
      uint32_t slots;
    };
    std::array<Pending, kBvhWidth> pending;
    size_t pending_count = 0;
    pending[pending_count++] = {&root, kBvhWidth};
    while (pending_count > 0) {
      const auto [node, slots] = pending[--pending_count];
      const uint32_t left = node->is_leaf() || slots == 1 ? 0 : node->choice.left_slots(slots);
      if (left == 0) {
        nodes_[size_++] = node;
      } else {
        pending[pending_count++] = {&node->children[1], slots - left};
        pending[pending_count++] = {&node->children[0], left};
      }
      LOCUS_DCHECK_LE(pending_count + size_, size_t{kBvhWidth});
    }
    LOCUS_DCHECK_CALL(check_children(root));
  }

  uint32_t size() const { return size_; }
  const BinaryNode<S>& operator[](size_t slot) const {
    LOCUS_DCHECK_LT(slot, size_);
    return *nodes_[slot];
  }

  // Sorts the children by increasing area; children of equal area keep their order.
  void sort_by_area() {
    std::array<S, kBvhWidth> areas;
    for (size_t i = 0; i < size_; ++i) {
      const BinaryNode<S>* const node = nodes_[i];
      const S area = half_area(node->bounds);
      size_t position = i;
      for (; position > 0 && areas[position - 1] > area; --position) {
        areas[position] = areas[position - 1];
        nodes_[position] = nodes_[position - 1];
      }
      areas[position] = area;
      nodes_[position] = node;
    }
  }

 private:
  // Verifies, in debug builds, that the children, from left to right, partition the references of `root`.
  void check_children(const BinaryNode<S>& root) const {
    uint32_t next = root.first;
    for (uint32_t i = 0; i < size_; ++i) {
      LOCUS_DCHECK_EQ(nodes_[i]->first, next);
      next += nodes_[i]->count;
    }
    LOCUS_DCHECK_EQ(next, root.first + root.count);
  }

  std::array<const BinaryNode<S>*, kBvhWidth> nodes_;
  uint32_t size_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_WIDE_CHILDREN_H_
