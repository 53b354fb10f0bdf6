// Nodes of a tree that divides space by planes perpendicular to the axes: they know the bounds of values and list the
// values by slot numbers, so that this code does not depend on the type of the values.
#ifndef LOCUS_CORE_INDEX_PLANE_NODES_H_
#define LOCUS_CORE_INDEX_PLANE_NODES_H_

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "core/base/planted_bug.h"
#include "core/geometry/aabb.h"
#include "core/index/filed_values.h"

namespace locus {

// Bounds and position of a value: all that a division of a node knows of it.
template <class S>
struct PlacedBounds {
  Aabb<S> bounds;
  Vec3<S> position;
};

// Size of a tree. A reference is one entry of a value in the list of a node.
struct PlaneTreeShape {
  size_t nodes;
  size_t references;
  uint32_t depth;  // levels below the root
};

// Base of KdNodes and OctreeNodes, which derive from it as `Nodes`. A `Node` has a list `values` of slots. `Nodes` has
// for_each_place(bounds, fn), which calls fn(node) for each node in which a value with these bounds lies, and
// divide(node, values, parts), which divides a node or leaves it undivided.
// Threads: one at a time; const members may run concurrently.
template <class S, class Node, class Nodes>
class PlaneNodes {
 public:
  const Node& operator[](uint32_t node) const { return nodes_[node]; }

  // Builds the nodes of `values`, whose slots are 0, 1, 2, ... Divides the nodes level by level, so that the limits of
  // nodes and references leave the levels equally deep.
  void build(absl::Span<const PlacedBounds<S>> values) {
    nodes_.assign(1, Node());
    nodes_[0].values.resize(values.size());
    std::iota(nodes_[0].values.begin(), nodes_[0].values.end(), uint32_t{0});
    references_ = values.size();
    depth_ = 0;
    constexpr S kInfinity = std::numeric_limits<S>::infinity();
    std::vector<Part> parts = {{{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}}, 0}};
    for (uint32_t node = 0; node < nodes_.size(); ++node) static_cast<Nodes*>(this)->divide(node, values, parts);
  }

  // Lists `slot` in the nodes in which a value with `bounds` lies. Returns the number of these nodes.
  uint32_t insert(uint32_t slot, const Aabb<S>& bounds) {
    uint32_t places = 0;
    self().for_each_place(bounds, [&](uint32_t node) {
      nodes_[node].values.push_back(slot);
      ++places;
    });
    references_ += places;
    return places;
  }

  // Removes `slot` from the nodes that list it.
  void remove(uint32_t slot, const Aabb<S>& bounds) {
    bool first = true;
    self().for_each_place(bounds, [&](uint32_t node) {
      if (planted(PlantedBug::kPlaneTreeReferenceLeft) && !std::exchange(first, false)) return;
      erase_slot(nodes_[node].values, slot);
      --references_;
    });
  }

  // Returns the number of the nodes in which a value with `bounds` lies and that list `slot`.
  size_t count(uint32_t slot, const Aabb<S>& bounds) const {
    size_t places = 0;
    self().for_each_place(bounds, [&](uint32_t node) {
      const std::vector<uint32_t>& values = nodes_[node].values;
      places += std::find(values.begin(), values.end(), slot) != values.end() ? 1 : 0;
    });
    return places;
  }

  template <class Fn>
  void for_each_reference(const Fn& fn) const {
    for (const Node& node : nodes_)
      for (const uint32_t slot : node.values) fn(slot);
  }

  // O(1).
  PlaneTreeShape shape() const { return {nodes_.size(), references_, depth_}; }

 protected:
  // Part of space that a node divides, while the tree is built.
  struct Part {
    Aabb<S> box;
    uint32_t depth;
  };

  std::vector<Node> nodes_ = std::vector<Node>(1);  // the root, then groups of children in the order of their parents
  size_t references_ = 0;
  uint32_t depth_ = 0;

 private:
  const Nodes& self() const { return static_cast<const Nodes&>(*this); }
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_PLANE_NODES_H_
