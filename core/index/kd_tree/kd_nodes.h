// Nodes of a kd tree: they know the bounds of values and list the values by slot numbers, so that this code does not
// depend on the type of the values. One thread at a time; const members may run concurrently.
#ifndef LOCUS_CORE_INDEX_KD_TREE_KD_NODES_H_
#define LOCUS_CORE_INDEX_KD_TREE_KD_NODES_H_

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/index/filed_values.h"
#include "core/index/kd_tree/kd_split.h"

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

// Size of a tree. A reference is one entry of a value in the list of a node.
struct KdShape {
  size_t nodes;
  size_t references;
  uint32_t depth;  // levels below the root
};

template <class S>
class KdNodes {
 public:
  explicit KdNodes(const KdTreeOptions& options) : options_(options), nodes_(1) {
    LOCUS_CHECK(options.leaf_size > 0);
    LOCUS_CHECK_LE(options.max_depth, limits::kMaxKdDepth);
  }

  const KdTreeOptions& options() const { return options_; }
  const KdNode<S>& operator[](uint32_t node) const { return nodes_[node]; }

  // Builds the nodes of `values`, whose slots are 0, 1, 2, ... Divides the nodes level by level, so that the limits of
  // nodes and references leave the levels equally deep.
  void build(absl::Span<const KdValue<S>> values) {
    nodes_.assign(1, KdNode<S>());
    nodes_[0].values.resize(values.size());
    std::iota(nodes_[0].values.begin(), nodes_[0].values.end(), uint32_t{0});
    references_ = values.size();
    depth_ = 0;
    constexpr S kInfinity = std::numeric_limits<S>::infinity();
    std::vector<Part> parts = {{{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}}, 0}};
    for (uint32_t node = 0; node < nodes_.size(); ++node) divide(node, values, parts);
  }

  // Lists `slot` in the nodes in which a value with `bounds` lies. Returns the number of these nodes.
  uint32_t insert(uint32_t slot, const Aabb<S>& bounds) {
    uint32_t places = 0;
    for_each_place(bounds, [&](uint32_t node) {
      nodes_[node].values.push_back(slot);
      ++places;
    });
    references_ += places;
    return places;
  }

  // Removes `slot` from the nodes that list it.
  void remove(uint32_t slot, const Aabb<S>& bounds) {
    bool first = true;
    for_each_place(bounds, [&](uint32_t node) {
      if (planted(PlantedBug::kKdReferenceLeft) && !std::exchange(first, false)) return;
      erase_slot(nodes_[node].values, slot);
      --references_;
    });
  }

  // Returns the number of the nodes in which a value with `bounds` lies and that list `slot`.
  size_t count(uint32_t slot, const Aabb<S>& bounds) const {
    size_t places = 0;
    for_each_place(bounds, [&](uint32_t node) {
      const std::vector<uint32_t>& values = nodes_[node].values;
      places += std::find(values.begin(), values.end(), slot) != values.end() ? 1 : 0;
    });
    return places;
  }

  template <class Fn>
  void for_each_reference(const Fn& fn) const {
    for (const KdNode<S>& node : nodes_)
      for (const uint32_t slot : node.values) fn(slot);
  }

  KdShape shape() const { return {nodes_.size(), references_, depth_}; }

 private:
  // Part of space that a node divides, while the tree is built.
  struct Part {
    Aabb<S> box;
    uint32_t depth;
  };

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
  void divide(uint32_t node, absl::Span<const KdValue<S>> values, std::vector<Part>& parts) {
    const Part part = parts[node];
    const std::vector<uint32_t>& slots = nodes_[node].values;
    depth_ = std::max(depth_, part.depth);
    if (slots.size() <= options_.leaf_size || part.depth >= options_.max_depth) return;
    if (nodes_.size() + 2 >= 2 * values.size()) return;
    std::vector<KdValue<S>> inside;
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

  Division divided(const std::vector<uint32_t>& slots, absl::Span<const KdValue<S>> values, int axis, S plane) const {
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
  std::vector<KdNode<S>> nodes_;  // the root, then pairs of children in the order of their parents
  size_t references_ = 0;
  uint32_t depth_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_KD_TREE_KD_NODES_H_
