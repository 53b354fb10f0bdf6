// Tree that divides space by planes perpendicular to the axes: the values, and how they are added and removed. Base of
// KdTree and Octree, which visit its nodes. `Nodes` (plane_nodes.h) knows where the planes are.
//
// insert() and remove() never divide or join nodes, so the tree degrades when its values change much: a leaf grows by
// every value that is inserted into its part of space. rebuild() makes the tree that was made of the same values at
// first. A tree that was made of no values is one leaf, until rebuild().
//
// Threads: const members may run concurrently; insert, remove and rebuild need exclusive use.
// Invariants: The bounds of the tree contain all values. Exactly the nodes list a value in which it lies. After a
// build, nodes < 2n and references < 4n for n > 0 values, and no leaf is deeper than the options allow.
#ifndef LOCUS_CORE_INDEX_PLANE_TREE_H_
#define LOCUS_CORE_INDEX_PLANE_TREE_H_

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/index/filed_values.h"
#include "core/index/plane_nodes.h"
#include "core/index/spatial_index.h"

namespace locus {

template <class V, class T, class Nodes>
requires Bounded<V, T>
class PlaneTree {
  using S = typename T::Scalar;

 public:
  using Value = V;
  using Traits = T;

  // Makes the tree again from its values, with the options of the first build. O(n log n) if the planes divide the
  // values evenly; at most O(n * depth).
  void rebuild() {
    values_.close_gaps();
    bounds_ = Aabb<S>();
    std::vector<PlacedBounds<S>> placed;
    placed.reserve(size());
    for (uint32_t slot = 0; slot < size(); ++slot) {
      Entry& entry = values_[slot];
      entry.places = 0;
      bounds_ = merge(bounds_, entry.bounds);
      placed.push_back({entry.bounds, Traits::position(entry.value)});
    }
    nodes_.build(placed);
    nodes_.for_each_reference([this](uint32_t slot) { ++values_[slot].places; });
    LOCUS_DCHECK_CALL(check_invariants());
  }

  // Inserts a value. Preconditions: no value has its id; its bounds are finite and not empty. O(depth + leaves that
  // the value touches).
  void insert(const V& value) {
    const uint32_t slot = values_.add(value);
    Entry& entry = values_[slot];
    if (!planted(PlantedBug::kPlaneTreeFixedBounds) || bounds_.empty()) bounds_ = merge(bounds_, entry.bounds);
    entry.places = nodes_.insert(slot, entry.bounds);
    LOCUS_DCHECK_CALL(check_value(slot));
  }

  // Removes the value with the id of `value`. Returns false and changes nothing if the tree has no value with this id.
  // Searches the leaves that the value touches: O(depth + values in these leaves).
  bool remove(const V& value) {
    const std::optional<uint32_t> slot = values_.remove(value);
    if (slot) nodes_.remove(*slot, values_[*slot].bounds);
    return slot.has_value();
  }

  bool contains(const V& value) const { return values_.contains(value); }
  size_t size() const { return values_.size(); }
  // Returns the box around all values; after remove() it may be larger, until rebuild().
  const Aabb<S>& bounds() const { return bounds_; }
  // Returns the numbers of nodes and references, and the depth. O(1).
  PlaneTreeShape shape() const { return nodes_.shape(); }

 protected:
  // Makes an empty tree.
  template <class Options>
  explicit PlaneTree(const Options& options) : nodes_(options) {}

  // Adds values to an empty tree and builds it.
  void fill(std::vector<V> values) {
    values_.reserve(values.size());
    for (V& value : values) values_.add(std::move(value));
    rebuild();
  }

  // Passes the wanted values of a node to the visitor (FiledValues::pass()).
  template <class Node, class Wanted, class Visitor>
  bool pass_values(const Node& node, const Wanted& wanted, Visitor& visitor, PassedValues& passed, Work& work) const {
    const PassEach each = planted(PlantedBug::kPlaneTreePassedTwice) ? PassEach::kAtEveryNode : PassEach::kOnce;
    return values_.pass(node.values, wanted, visitor, passed, work, each);
  }

  const Nodes& nodes() const { return nodes_; }

 private:
  using Entry = typename FiledValues<V, T>::Entry;

  // Checks that exactly the nodes list the value in which it lies. O(depth + values in these nodes).
  void check_value(uint32_t slot) const {
    LOCUS_DCHECK_EQ(nodes_.count(slot, values_[slot].bounds), values_[slot].places);
    LOCUS_DCHECK(values_[slot].places > 0);
    if (!planted(PlantedBug::kPlaneTreeFixedBounds)) LOCUS_DCHECK(locus::contains(bounds_, values_[slot].bounds));
  }
  // Checks all values, and the limits of nodes and references after a build. O(n * depth).
  void check_invariants() const {
    for (const uint32_t slot : values_.slots()) check_value(slot);
    const PlaneTreeShape shape = this->shape();
    LOCUS_DCHECK(size() == 0 || (shape.nodes < 2 * size() && shape.references < 4 * size()));
    LOCUS_DCHECK_LE(shape.depth, nodes_.options().max_depth);
  }

  FiledValues<V, T> values_;
  Aabb<S> bounds_;
  Nodes nodes_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_PLANE_TREE_H_
