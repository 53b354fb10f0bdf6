// The binary tree over boxes that wide trees are made from: splits by the binned surface area heuristic, halves where
// that finds nothing, leaves of up to kBvhLeafSize. Equal references and options give an equal tree, whatever
// BvhOptions::parallel_for makes of the pieces of work. Internal to this folder: build_bvh_layout() and TriangleBvh are
// its users. Source: Wald, On fast Construction of SAH-based Bounding Volume Hierarchies, 2007.
#ifndef LOCUS_CORE_INDEX_BVH_BINARY_TREE_H_
#define LOCUS_CORE_INDEX_BVH_BINARY_TREE_H_

#include <array>
#include <bit>
#include <deque>
#include <memory>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/base/limits.h"
#include "core/index/bvh/bvh_build.h"
#include "core/index/bvh/quad.h"
#include "core/index/bvh/wide_choice.h"

namespace locus {

// A value's box and its index, which lies in the spare lane of `min`. Without defaults: large arrays of it are filled
// by many threads.
template <class S>
struct BoxReference {
  Quad<S> min, max;

  // The box's spare lanes may hold anything.
  static BoxReference of(const QuadBox<S>& box, uint32_t index);
  uint32_t index() const;
  QuadBox<S> box() const { return {min, max}; }
  // Twice the centre: only compared with its like.
  Quad<S> center() const { return min + max; }
};

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

// A whole number as the bits of an ordinary float, whose sums and products cost nothing.
template <>
inline BoxReference<float> BoxReference<float>::of(const QuadBox<float>& box, uint32_t index) {
  constexpr uint32_t kOrdinary = 0x40000000u;
  BoxReference reference = {box.min, box.max};
  reference.min.lanes[3] = std::bit_cast<float>(index | kOrdinary);
  return reference;
}
template <>
inline uint32_t BoxReference<float>::index() const {
  return std::bit_cast<uint32_t>(min[3]) & 0x3FFFFFFFu;
}
template <>
inline BoxReference<double> BoxReference<double>::of(const QuadBox<double>& box, uint32_t index) {
  BoxReference reference = {box.min, box.max};
  reference.min.lanes[3] = index;
  return reference;
}
template <>
inline uint32_t BoxReference<double>::index() const {
  return static_cast<uint32_t>(min[3]);
}
static_assert(limits::kMaxBvhValues <= 0x3FFFFFFFu);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_BINARY_TREE_H_
