// Nodes of an octree, and how they are divided. One thread at a time; const members may run concurrently.
#ifndef LOCUS_CORE_INDEX_OCTREE_OCTREE_NODES_H_
#define LOCUS_CORE_INDEX_OCTREE_OCTREE_NODES_H_

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/planted_bug.h"
#include "core/geometry/aabb.h"
#include "core/index/cut_values.h"
#include "core/index/plane_nodes.h"

namespace locus {

// Axes on which the nodes of a tree are divided, at least one: one axis makes an interval tree, two make a quadtree and
// three make an octree.
struct OctreeAxes {
  bool x = true;
  bool y = true;
  bool z = true;
};

struct OctreeOptions {
  OctreeAxes axes;
  CutValues cut = CutValues::kInLeaves;
  uint32_t leaf_size = 8;   // nodes with at most so many values are not divided; at least 1
  uint32_t max_depth = 32;  // max levels below the root, at most limits::kMaxOctreeDepth
};

template <class S>
struct OctreeNode {
  std::vector<uint32_t> values;  // slots: of the values in a leaf or, with CutValues::kAtNode, of those a plane cuts
  Vec3<S> middle;                // where the planes cross that divide the node
  uint32_t first_child = 0;      // the children follow each other; 0 in a leaf

  bool is_leaf() const { return first_child == 0; }
};

// The bits of a child's number say on which side of the planes it lies: bit i is set if it is above the plane
// perpendicular to the i-th of the divided axes. A value is below a plane if its bounds begin at or below the plane,
// and above if they end above the plane.
template <class S>
class OctreeNodes : public PlaneNodes<S, OctreeNode<S>, OctreeNodes<S>> {
 public:
  // One pending sibling for each child but one, for each level.
  static constexpr size_t kStackSize = 7 * size_t{limits::kMaxOctreeDepth} + 1;
  template <class Pending>
  using Stack = absl::InlinedVector<Pending, 64>;

  explicit OctreeNodes(const OctreeOptions& options) : options_(options) {
    LOCUS_CHECK(options.leaf_size > 0);
    LOCUS_CHECK_LE(options.max_depth, limits::kMaxOctreeDepth);
    const bool divided[] = {options.axes.x, options.axes.y, options.axes.z};
    for (int axis = 0; axis < 3; ++axis) {
      if (divided[axis]) axes_.push_back(axis);
    }
    LOCUS_CHECK(!axes_.empty());
  }

  const OctreeOptions& options() const { return options_; }
  absl::Span<const int> axes() const { return axes_; }
  uint32_t child_count() const { return 1u << axes_.size(); }

 private:
  using Base = PlaneNodes<S, OctreeNode<S>, OctreeNodes<S>>;
  friend Base;
  using Base::depth_, Base::nodes_, Base::references_;
  using typename Base::Part;

  // Sides of the planes of a node on which a value lies, as sets of bits of the numbers of children.
  struct Sides {
    uint32_t below = 0;
    uint32_t above = 0;

    bool cut() const { return (below & above) != 0; }
    bool holds(uint32_t child) const { return (child & ~above) == 0 && (~child & ~below) == 0; }
  };

  Sides sides_of(const Vec3<S>& middle, const Aabb<S>& bounds) const {
    Sides sides;
    sides.below = ~0u << axes_.size();  // so that holds() compares only the bits of axes
    for (size_t i = 0; i < axes_.size(); ++i) {
      const int axis = axes_[i];
      if (bounds.min[axis] <= middle[axis]) sides.below |= 1u << i;
      if (bounds.max[axis] > middle[axis]) sides.above |= 1u << i;
    }
    return sides;
  }

  // Calls fn(node) for each node in which a value with `bounds` lies.
  template <class Fn>
  void for_each_place(const Aabb<S>& bounds, const Fn& fn) const {
    Stack<uint32_t> pending = {0};
    while (!pending.empty()) {
      const uint32_t index = pending.back();
      pending.pop_back();
      const OctreeNode<S>& node = nodes_[index];
      const Sides sides = node.is_leaf() ? Sides() : sides_of(node.middle, bounds);
      if (node.is_leaf() || (sides.cut() && options_.cut == CutValues::kAtNode)) {
        fn(index);
        continue;
      }
      for (uint32_t child = 0; child < child_count(); ++child) {
        if (sides.holds(child)) pending.push_back(node.first_child + child);
      }
    }
  }

  // Divides a node that has more values than a leaf may have at the middle of their extent within the node's part of
  // space, unless no plane separates any of them.
  void divide(uint32_t node, absl::Span<const PlacedBounds<S>> values, std::vector<Part>& parts) {
    const Part part = parts[node];
    const std::vector<uint32_t>& slots = nodes_[node].values;
    depth_ = std::max(depth_, part.depth);
    if (slots.size() <= options_.leaf_size || part.depth >= options_.max_depth) return;
    if (nodes_.size() + child_count() >= 2 * values.size()) return;
    Aabb<S> box;
    for (const uint32_t slot : slots) {
      const Aabb<S>& bounds = values[slot].bounds;
      box = merge(box, {max(bounds.min, part.box.min), min(bounds.max, part.box.max)});
    }
    Vec3<S> middle;
    for (int axis = 0; axis < 3; ++axis) {
      middle[axis] = box.min[axis] / 2 + box.max[axis] / 2;
      if (middle[axis] >= box.max[axis]) middle[axis] = box.min[axis];  // the sides are equal or adjacent numbers
    }
    std::vector<std::vector<uint32_t>> children(child_count());
    std::vector<uint32_t> at_node;
    for (const uint32_t slot : slots) {
      const Sides sides = sides_of(middle, values[slot].bounds);
      if ((sides.cut() && options_.cut == CutValues::kAtNode)) {
        at_node.push_back(slot);
        continue;
      }
      for (uint32_t child = 0; child < child_count(); ++child) {
        if (sides.holds(child)) children[child].push_back(slot);
      }
    }
    if (worthwhile(children, slots.size(), at_node.size(), values.size()))
      apply(node, middle, std::move(children), std::move(at_node), parts);
  }

  // Returns whether a division of `count` values separates some of them, makes at most twice as many references, and
  // keeps within the limit of 4n references to `total` values.
  bool worthwhile(const std::vector<std::vector<uint32_t>>& children, size_t count, size_t at_node,
                  size_t total) const {
    size_t below = 0, most = 0;
    for (const std::vector<uint32_t>& child : children) {
      below += child.size();
      most = std::max(most, child.size());
    }
    if (below == 0 || (most == count && below == count) || below > 2 * count) return false;
    return references_ - count + below + at_node < 4 * total;
  }

  void apply(uint32_t node, const Vec3<S>& middle, std::vector<std::vector<uint32_t>> children,
             std::vector<uint32_t> at_node, std::vector<Part>& parts) {
    const Part part = parts[node];
    references_ -= nodes_[node].values.size();
    references_ += at_node.size();
    nodes_[node].values = std::move(at_node);
    nodes_[node].middle = middle;
    nodes_[node].first_child = static_cast<uint32_t>(nodes_.size());
    for (uint32_t child = 0; child < child_count(); ++child) {
      Part& inner = parts.emplace_back(Part{part.box, part.depth + 1});
      for (size_t i = 0; i < axes_.size(); ++i) {
        const int axis = axes_[i];
        (((child >> i) & 1) != 0 ? inner.box.min : inner.box.max)[axis] = middle[axis];
      }
      references_ += children[child].size();
      nodes_.emplace_back().values = std::move(children[child]);
    }
  }

  OctreeOptions options_;
  absl::InlinedVector<int, 3> axes_;  // the divided axes, ascending
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_OCTREE_OCTREE_NODES_H_
