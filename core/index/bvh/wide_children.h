// The children of one wide node: the binary nodes that the tree's choices leave in its eight slots. Plain data.
#ifndef LOCUS_CORE_INDEX_BVH_WIDE_CHILDREN_H_
#define LOCUS_CORE_INDEX_BVH_WIDE_CHILDREN_H_

#include <array>

#include "core/index/bvh/binary_tree.h"

namespace locus {

template <class S>
class WideChildren {
 public:
  // Left to right. Of a leaf, which only a tree of one leaf has for a root: itself.
  explicit WideChildren(const BinaryNode<S>& root) {
    struct Pending {
      const BinaryNode<S>* node;
      uint32_t slots;
    };
    std::array<Pending, kBvhWidth> pending;
    size_t waiting = 0;
    pending[waiting++] = {&root, kBvhWidth};
    while (waiting > 0) {
      const auto [node, slots] = pending[--waiting];
      const uint32_t left = node->is_leaf() || slots == 1 ? 0 : node->choice.left_slots(slots);
      if (left == 0) {
        nodes_[size_++] = node;
      } else {
        pending[waiting++] = {&node->children[1], slots - left};
        pending[waiting++] = {&node->children[0], left};
      }
    }
  }

  uint32_t size() const { return size_; }
  const BinaryNode<S>& operator[](size_t slot) const { return *nodes_[slot]; }

  // By rising area, equal ones left to right.
  void sort_by_area() {
    std::array<S, kBvhWidth> areas;
    for (size_t i = 0; i < size_; ++i) {
      const BinaryNode<S>* const node = nodes_[i];
      const S area = half_area(node->bounds);
      size_t place = i;
      for (; place > 0 && areas[place - 1] > area; --place) {
        areas[place] = areas[place - 1];
        nodes_[place] = nodes_[place - 1];
      }
      areas[place] = area;
      nodes_[place] = node;
    }
  }

 private:
  std::array<const BinaryNode<S>*, kBvhWidth> nodes_;
  uint32_t size_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_WIDE_CHILDREN_H_
