// Nodes of a kd tree, and how they are divided. One thread at a time; const members may run concurrently.
#ifndef LOCUS_CORE_INDEX_KD_TREE_KD_NODES_H_
#define LOCUS_CORE_INDEX_KD_TREE_KD_NODES_H_

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/index/kd_tree/kd_split.h"
#include "core/index/plane_nodes.h"

namespace locus {

template <class S>
struct KdNode {
  std::vector<uint32_t> values;  // slots: of the values in a leaf or, with CutValues::kAtNode, of those the plane cuts
  S plane = 0;
  uint32_t below = 0;  // node below the plane; the node above the plane follows it; 0 in a leaf
  uint8_t axis = 0;

  bool is_leaf() const { return below == 0; }
  uint32_t above() const { return below + 1; }
};

enum class KdSide : uint8_t { kBelow, kAbove };

// Returns the closed half space on one side of the node's plane.
template <class S>
Aabb<S> half_space(const KdNode<S>& node, KdSide side) {
  constexpr S kInfinity = std::numeric_limits<S>::infinity();
  Aabb<S> box = {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
  (side == KdSide::kBelow ? box.max : box.min)[node.axis] = node.plane;
  return box;
}

template <class S>
class KdNodes : public PlaneNodes<S, KdNode<S>, KdNodes<S>> {
 public:
  explicit KdNodes(const KdTreeOptions& options) : options_(options) {
    LOCUS_CHECK(options.leaf_size > 0);
    LOCUS_CHECK_LE(options.max_depth, limits::kMaxKdDepth);
  }

  const KdTreeOptions& options() const { return options_; }

 private:
  using Base = PlaneNodes<S, KdNode<S>, KdNodes<S>>;
  friend Base;
  using Base::depth_, Base::nodes_, Base::references_;
  using typename Base::Part;

  struct Division {
    std::vector<uint32_t> below, above, at_node;
  };

  // Calls fn(node) for each node in which a value with `bounds` lies.
  template <class Fn>
  void for_each_place(const Aabb<S>& bounds, const Fn& fn) const {
    absl::InlinedVector<uint32_t, limits::kMaxKdDepth + 1> pending = {0};
    while (!pending.empty()) {
      const uint32_t index = pending.back();
      pending.pop_back();
      const KdNode<S>& node = nodes_[index];
      const bool below = bounds.min[node.axis] <= node.plane, above = bounds.max[node.axis] > node.plane;
      if (node.is_leaf() || (below && above && options_.cut == CutValues::kAtNode)) {
        fn(index);
        continue;
      }
      if (above) pending.push_back(node.above());
      if (below) pending.push_back(node.below);
    }
  }

  // Divides a node that has more values than a leaf may have, unless no plane separates any of them.
  void divide(uint32_t node, absl::Span<const PlacedBounds<S>> values, std::vector<Part>& parts) {
    const Part part = parts[node];
    const std::vector<uint32_t>& slots = nodes_[node].values;
    depth_ = std::max(depth_, part.depth);
    if (slots.size() <= options_.leaf_size || part.depth >= options_.max_depth) return;
    if (nodes_.size() + 2 >= 2 * values.size()) return;
    std::vector<PlacedBounds<S>> inside;
    inside.reserve(slots.size());
    Aabb<S> box;
    for (const uint32_t slot : slots) {
      const Aabb<S>& bounds = values[slot].bounds;
      inside.push_back({{max(bounds.min, part.box.min), min(bounds.max, part.box.max)}, values[slot].position});
      box = merge(box, inside.back().bounds);
    }
    const int first = first_axis(box, part.depth);
    for (int i = 0; i < 3; ++i) {
      const int axis = (first + i) % 3;
      const std::optional<S> plane = kd_plane<S>(options_.split, inside, axis, box, options_.cut);
      if (!plane) continue;
      Division division = divided(slots, values, axis, *plane);
      if (!worthwhile(division, slots.size(), values.size())) continue;
      apply(node, axis, *plane, std::move(division), parts);
      return;
    }
  }

  int first_axis(const Aabb<S>& box, uint32_t depth) const {
    if (options_.axis == KdAxis::kByTurns) return static_cast<int>(depth % 3);
    const Vec3<S> extent = box.extent();
    return extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  }

  Division divided(const std::vector<uint32_t>& slots, absl::Span<const PlacedBounds<S>> values, int axis,
                   S plane) const {
    Division division;
    for (const uint32_t slot : slots) {
      const Aabb<S>& bounds = values[slot].bounds;
      const bool below = bounds.min[axis] <= plane, above = bounds.max[axis] > plane;
      if (below && above && options_.cut == CutValues::kAtNode) {
        division.at_node.push_back(slot);
        continue;
      }
      if (below) division.below.push_back(slot);
      if (above) division.above.push_back(slot);
    }
    return division;
  }

  // Returns whether a division of `count` values makes both parts smaller than their node, cuts at most half of the
  // values, and keeps within the limit of 4n references to `total` values.
  bool worthwhile(const Division& division, size_t count, size_t total) const {
    const size_t below = division.below.size(), above = division.above.size();
    if (below + above == 0 || below == count || above == count || below + above > count + count / 2) return false;
    return references_ - count + below + above + division.at_node.size() < 4 * total;
  }

  void apply(uint32_t node, int axis, S plane, Division division, std::vector<Part>& parts) {
    references_ -= nodes_[node].values.size();
    references_ += division.below.size() + division.above.size() + division.at_node.size();
    Part below = parts[node], above = parts[node];
    below.box.max[axis] = above.box.min[axis] = plane;
    const uint32_t depth = below.depth;
    below.depth = above.depth = depth + 1;
    nodes_[node].values = std::move(division.at_node);
    nodes_[node].plane = plane;
    nodes_[node].axis = static_cast<uint8_t>(planted(PlantedBug::kKdAxisByTurns) ? depth % 3 : axis);
    nodes_[node].below = static_cast<uint32_t>(nodes_.size());
    nodes_.emplace_back().values = std::move(division.below);
    nodes_.emplace_back().values = std::move(division.above);
    parts.push_back(below);
    parts.push_back(above);
  }

  KdTreeOptions options_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_KD_TREE_KD_NODES_H_
