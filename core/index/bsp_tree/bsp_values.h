// Values of a BspTree, filed by their bounds in the cells of a BspSpace: how values are added and removed, and when
// leaves are divided and joined. Internal to this folder; the functions are described in bsp_tree.h.
#ifndef LOCUS_CORE_INDEX_BSP_TREE_BSP_VALUES_H_
#define LOCUS_CORE_INDEX_BSP_TREE_BSP_VALUES_H_

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/index/bsp_tree/bsp_space.h"
#include "core/index/bsp_tree/plane_choice.h"
#include "core/index/cut_values.h"
#include "core/index/filed_values.h"
#include "core/index/spatial_index.h"

namespace locus {

struct BspTreeOptions {
  // Place of the values that a plane cuts or touches.
  CutValues cut = CutValues::kInLeaves;
  // Planes that may divide space.
  BspPlanes planes = BspPlanes::kBest;
  // Number of values above which a leaf is divided, at least 1. Larger leaves make smaller trees and slower queries.
  uint32_t leaf_size = 8;
  // Largest number of planes above a leaf, at most limits::kMaxBspDepth. A leaf at this depth holds any number of
  // values.
  uint32_t max_depth = limits::kMaxBspDepth;
};

struct BspTreeShape {
  size_t nodes = 0;       // inner nodes and leaves
  size_t references = 0;  // values listed at nodes; a value counts once for each of them
  uint32_t depth = 0;     // largest number of planes above a leaf
};

// Invariants: each value is listed at `places` nodes, those that homes_of() returns for its bounds; after rebuild(),
// there are fewer than two nodes and four references for each value.
template <class V, class Traits>
requires Bounded<V, Traits>
class BspValues {
  using S = typename Traits::Scalar;

 public:
  using Entry = typename FiledValues<V, Traits>::Entry;

  explicit BspValues(const BspTreeOptions& options) : options_(options) {
    LOCUS_CHECK_LT(0u, options_.leaf_size);
    LOCUS_CHECK_LE(options_.max_depth, limits::kMaxBspDepth);
    space_[BspNode::kRoot].limit = options_.leaf_size;
  }

  // Makes the tree that BspTree::build() returns. Precondition: there are no values yet.
  void build(std::vector<V> values) {
    entries_.reserve(values.size());
    for (V& value : values) add_entry(std::move(value));
    rebuild();
  }

  void insert(const V& value) {
    const uint32_t slot = add_entry(value);
    Entry& entry = entries_[slot];
    const std::vector<uint32_t> homes = homes_of(to_double(entry.bounds));
    entry.places = static_cast<uint32_t>(homes.size());
    references_ += homes.size();
    for (const uint32_t home : homes) space_[home].references.push_back(slot);
    divide_full(homes);
    const bool deep = too_deep_ && size() >= 2 * built_size_;
    if (deep || references_ >= std::max(4 * size(), 2 * built_references_)) rebuild();
    LOCUS_DCHECK_CALL(check_invariants());
  }

  bool remove(const V& value) {
    const std::optional<uint32_t> slot = entries_.remove(value);
    if (!slot) return false;
    const std::vector<uint32_t> homes = homes_of(to_double(entries_[*slot].bounds));
    for (const uint32_t home : homes) {
      erase_slot(space_[home].references, *slot);
      if (planted(PlantedBug::kBspRemoveOnce)) break;
    }
    references_ -= homes.size();
    for (const uint32_t home : homes) join_empty(home);
    if (space_.node_count() > 64 && space_.node_count() >= 4 * size()) rebuild();
    LOCUS_DCHECK_CALL(check_invariants());
    return true;
  }

  bool contains(const V& value) const { return entries_.contains(value); }
  size_t size() const { return entries_.size(); }
  const BspSpace& space() const { return space_; }
  const FiledValues<V, Traits>& entries() const { return entries_; }
  // Returns an upper bound of the |coordinates| of all bounds.
  S magnitude() const { return magnitude_; }
  BspTreeShape shape() const { return {space_.node_count(), references_, space_.depth()}; }

 private:
  static constexpr size_t kOfferedPlanes = 8;  // maximum number of values whose planes are tried for one leaf

  uint32_t add_entry(V value) {
    const uint32_t slot = entries_.add(std::move(value));
    magnitude_ = std::max(magnitude_, locus::magnitude(entries_[slot].bounds));
    return slot;
  }

  // Returns the indices of the nodes that list a value with these bounds.
  std::vector<uint32_t> homes_of(const Aabbd& bounds) const {
    std::vector<uint32_t> homes;
    BspSpace::Stack<uint32_t> pending = {BspNode::kRoot};
    while (!pending.empty()) {
      const uint32_t index = pending.back();
      const BspNode& node = space_[index];
      pending.pop_back();
      const Sides sides = node.is_leaf() ? Sides{} : sides_of(node.plane, bounds);
      if (node.is_leaf() || (sides.both() && options_.cut == CutValues::kAtNode)) {
        homes.push_back(index);
        continue;
      }
      if (sides.back) pending.push_back(node.child + 1);
      if (sides.front) pending.push_back(node.child);
    }
    return homes;
  }

  // Divides the leaves of `pending` that have too many values, and the leaves that this makes, in order of their depth.
  void divide_full(std::vector<uint32_t> pending) {
    for (size_t i = 0; i < pending.size(); ++i) {
      BspNode& node = space_[pending[i]];
      if (!node.is_leaf() || node.references.size() <= node.limit) continue;
      if (const std::optional<Plane> plane = plane_for(node)) {
        const uint32_t child = divide(pending[i], *plane);
        pending.insert(pending.end(), {child, child + 1});
      } else {
        node.limit = static_cast<uint32_t>(2 * node.references.size());
      }
    }
  }

  // Returns the plane that is to divide a leaf; nullopt if none divides it well within the limits of depth, nodes and
  // references.
  std::optional<Plane> plane_for(const BspNode& leaf) {
    too_deep_ |= leaf.depth >= options_.max_depth;
    if (leaf.depth >= options_.max_depth || space_.node_count() + 2 >= 2 * size()) return std::nullopt;
    std::vector<Aabbd> boxes;
    boxes.reserve(leaf.references.size());
    for (const uint32_t slot : leaf.references) boxes.push_back(to_double(entries_[slot].bounds));
    const std::optional<Division> division = choose_division(boxes, planes_of_values(leaf), options_.planes);
    if (!division) return std::nullopt;
    const size_t added = division->front + division->back - boxes.size();
    if (options_.cut == CutValues::kInLeaves && references_ + added > 3 * size()) return std::nullopt;
    return division->plane;
  }

  std::vector<Plane> planes_of_values(const BspNode& leaf) const {
    std::vector<Plane> planes;
    if constexpr (Planar<V, Traits>) {
      if (options_.planes == BspPlanes::kAxes) return planes;
      const size_t count = leaf.references.size(), step = std::max<size_t>(1, count / kOfferedPlanes);
      for (size_t i = 0; i < count && planes.size() < kOfferedPlanes; i += step)
        if (const auto plane = Traits::plane(entries_[leaf.references[i]].value)) planes.push_back(*plane);
    }
    return planes;
  }

  // Divides a leaf and files its values. Returns the index of the child in front.
  uint32_t divide(uint32_t leaf, const Plane& plane) {
    const uint32_t child = space_.divide(leaf, plane);
    const std::vector<uint32_t> references = std::exchange(space_[leaf].references, {});
    for (const uint32_t slot : references) {
      const Sides sides = sides_of(plane, to_double(entries_[slot].bounds));
      if (sides.both() && options_.cut == CutValues::kAtNode) {
        space_[leaf].references.push_back(slot);
        continue;
      }
      if (sides.front) space_[child].references.push_back(slot);
      if (sides.back) space_[child + 1].references.push_back(slot);
      if (sides.both()) {
        ++entries_[slot].places;
        ++references_;
      }
    }
    return child;
  }

  // Joins the node with its neighbour, and so on upwards, as long as both are leaves with few values.
  void join_empty(uint32_t index) {
    while (index != BspNode::kRoot && space_[index].parent != BspNode::kNotInUse) {
      const uint32_t parent = space_[index].parent, child = space_[parent].child;
      const BspNode &front = space_[child], &back = space_[child + 1];
      if (!front.is_leaf() || !back.is_leaf()) return;
      if (front.references.size() + back.references.size() > options_.leaf_size / 2) return;
      std::vector<uint32_t> references = space_[parent].references;
      references.insert(references.end(), front.references.begin(), front.references.end());
      for (const uint32_t slot : back.references) {
        if (std::find(front.references.begin(), front.references.end(), slot) == front.references.end()) {
          references.push_back(slot);
        } else {
          --entries_[slot].places;
          --references_;
        }
      }
      space_.join(parent);
      space_[parent].limit = std::max(options_.leaf_size, static_cast<uint32_t>(2 * references.size()));
      space_[parent].references = std::move(references);
      index = parent;
    }
  }

  // Files all values again in a space without planes, and divides it.
  void rebuild() {
    space_.clear();
    too_deep_ = false;
    BspNode& root = space_[BspNode::kRoot];
    root.limit = options_.leaf_size;
    root.references = entries_.slots();
    for (const uint32_t slot : root.references) entries_[slot].places = 1;
    references_ = size();
    divide_full({BspNode::kRoot});
    built_size_ = size();
    built_references_ = references_;
    LOCUS_DCHECK_CALL(check_built());
  }

  void check_invariants() const { LOCUS_DCHECK_LE(size(), references_); }

  // Verifies, in debug builds, the limits of a tree that was just built, and that each value is listed at the nodes
  // that homes_of() returns. O(n * depth).
  void check_built() const {
    const BspTreeShape now = shape();
    LOCUS_DCHECK(now.nodes == 1 || now.nodes < 2 * size());
    LOCUS_DCHECK(size() == 0 || now.references < 4 * size());
    LOCUS_DCHECK_LE(now.depth, size_t{options_.max_depth});
    for (const uint32_t slot : entries_.slots()) {
      const std::vector<uint32_t> homes = homes_of(to_double(entries_[slot].bounds));
      LOCUS_DCHECK_EQ(homes.size(), size_t{entries_[slot].places});
      for (const uint32_t home : homes) {
        const std::vector<uint32_t>& listed = space_[home].references;
        LOCUS_DCHECK(std::find(listed.begin(), listed.end(), slot) != listed.end());
      }
    }
  }

  BspTreeOptions options_;
  BspSpace space_;
  FiledValues<V, Traits> entries_;
  S magnitude_ = 0;
  size_t references_ = 0;
  size_t built_size_ = 0, built_references_ = 0;  // when the tree was last built
  bool too_deep_ = false;                         // a leaf has not been divided because of its depth
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BSP_TREE_BSP_VALUES_H_
