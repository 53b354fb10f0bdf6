// Index that divides all of space by planes: those in which values lie, if their traits have a plane, and planes across
// the axes. Every point belongs to the cell of exactly one leaf. Cells are convex, and their order from an eye or along
// a ray follows from the planes, which serves the painter's algorithm, portals, and sets of cells that see each other.
//
// A value is filed by its bounds. A value that a plane cuts or touches lies on both sides: it is listed in every leaf
// that it touches, or once at the node of the plane (CutValues). Bounds are filed conservatively (plane_sides.h), and a
// visit follows every plane on each side that its box, ray or point can reach, with the same bounds of rounding errors,
// so no value is lost.
//
// Threads: const members may run concurrently; insert and remove need exclusive use. Invariants: each value is listed
// at `homes` nodes, those that homes_of() returns for its bounds; after build(), there are fewer than two nodes and
// four references for each value. Sources: Fuchs, Kedem, Naylor, On Visible Surface Generation by A Priori Tree
// Structures, 1980; Hughes et al., Computer Graphics: Principles and Practice, 3rd ed., 2013, ch. 37 (BSP tree).
#ifndef LOCUS_CORE_INDEX_BSP_TREE_BSP_TREE_H_
#define LOCUS_CORE_INDEX_BSP_TREE_BSP_TREE_H_

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "core/base/planted_bug.h"
#include "core/index/bsp_tree/bsp_space.h"
#include "core/index/bsp_tree/bsp_values.h"
#include "core/index/cut_values.h"
#include "core/index/spatial_index.h"

namespace locus {

template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
class BspTree {
  using S = typename T::Scalar;

 public:
  using Value = V;
  using Traits = T;

  // Makes an empty tree.
  explicit BspTree(const BspTreeOptions& options = {}) : values_(options) {}

  // Builds a tree of `values`. Preconditions: their ids are unique; their bounds are finite and not empty. Typically
  // O(n log n), and at most O(n * max_depth).
  static BspTree build(std::vector<V> values, const BspTreeOptions& options = {}) {
    BspTree tree(options);
    tree.values_.build(std::move(values));
    return tree;
  }

  // Adds a value. Preconditions: no value of the tree has its id; its bounds are finite and not empty. O(depth) for
  // each leaf that the value touches. A leaf with too many values is divided. The whole tree is built again if it has
  // doubled since it was built and some leaf could not be divided because of its depth, or if values that touch many
  // leaves have doubled the number of references.
  void insert(const V& value) { values_.insert(value); }

  // Removes the value with the id of `value`, wherever `value` lies. Returns false and changes nothing if the tree has
  // no value with this id. O(depth + leaf) for each leaf that lists the value: the lists are searched for it. Leaves
  // whose neighbours are nearly empty as well are joined.
  bool remove(const V& value) { return values_.remove(value); }

  bool contains(const V& value) const { return values_.contains(value); }
  size_t size() const { return values_.size(); }
  // Returns the size of the tree. O(nodes).
  BspTreeShape shape() const { return values_.shape(); }

  // Passes to `visitor` the values whose own bounds the ray enters up to visitor.limit(), leaf by leaf from front to
  // back. Allocates memory only for values in several leaves.
  template <RayVisitor<V, T> Visitor>
  void visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const {
    using Next = BspSpace::Next;
    const PaddedRay ray(slabs, values_.magnitude());
    PassedValues passed;
    const auto accepts = [&](const Aabb<S>& bounds) {
      const Interval<S> interval = slabs.interval(bounds);
      return interval.near <= interval.far && interval.far >= 0 && interval.near <= visitor.limit();
    };
    const auto open = [&](uint32_t index, RaySpan span) {
      if (span.begin > ray.reach(visitor.limit())) return Next::kSkip;
      ++work.nodes;
      return pass(space()[index], accepts, passed, visitor, work) ? Next::kDescend : Next::kEnd;
    };
    space().visit_along(ray, {0, kEndless}, padded_spans, open);
  }

  // Passes to `visitor` the values whose own bounds visitor.overlaps() accepts. Allocates memory only for values in
  // several leaves.
  template <RegionVisitor<V, T> Visitor>
  void visit_region(Visitor& visitor, Work& work) const {
    const Aabbd region = to_double(visitor.bounds());
    PassedValues passed;
    const auto accepts = [&visitor](const Aabb<S>& bounds) { return visitor.overlaps(bounds); };
    BspSpace::Stack<uint32_t> pending = {BspNode::kRoot};
    while (!pending.empty()) {
      const BspNode& node = space()[pending.back()];
      pending.pop_back();
      ++work.nodes;
      if (!pass(node, accepts, passed, visitor, work)) return;
      if (node.is_leaf()) continue;
      const Sides sides = sides_of(node.plane, region);
      if (sides.back) pending.push_back(node.child + 1);
      if (sides.front) pending.push_back(node.child);
    }
  }

  // Passes to `visitor` the values whose own bounds have a squared distance of at most visitor.limit() from `point`,
  // roughly nearest first: the leaf of `point`, then the leaves beyond the nearest planes. Allocates memory only for
  // values in several leaves.
  template <PointVisitor<V, T> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
    struct Pending {
      uint32_t index;
      double squared_distance;  // lower bound for the values that lie only beyond planes between them and the point
    };
    PassedValues passed;
    const auto accepts = [&](const Aabb<S>& bounds) {
      return squared_distance(point, to_double(bounds)) <= visitor.limit();
    };
    BspSpace::Stack<Pending> pending = {{BspNode::kRoot, 0}};
    while (!pending.empty()) {
      const Pending now = pending.back();
      pending.pop_back();
      if (now.squared_distance > visitor.limit()) continue;
      const BspNode& node = space()[now.index];
      ++work.nodes;
      if (!pass(node, accepts, passed, visitor, work)) return;
      if (node.is_leaf()) continue;
      const uint32_t behind = signed_distance(node.plane, point) >= 0 ? 1 : 0;
      const double beyond = squared_distance_beyond(node.plane, point);
      pending.push_back({node.child + behind, std::max(now.squared_distance, beyond)});
      pending.push_back({node.child + 1 - behind, now.squared_distance});
    }
  }

  // Returns the number of the leaf whose cell contains `point`: after build(), an integer below shape().nodes. The
  // number denotes this cell for ever (CellNumber). O(depth).
  CellNumber leaf_of(const Vec3d& point) const { return space().number(space().leaf_of(point)); }

  // Returns whether `cell` is the number of a leaf, or of a cell that was divided since. False for cells that were
  // joined, or that a rebuild removed (see insert()).
  bool has_cell(CellNumber cell) const { return space().has_cell(cell); }

  // Returns the half-spaces whose intersection is the cell; none for all of space. A point on a plane of the cell
  // belongs to the neighbour in front of the tree's plane. Precondition: has_cell(leaf). O(depth).
  std::vector<Plane> cell_of_leaf(CellNumber leaf) const { return space().planes_around(space().node_of(leaf)); }

  // Calls fn(value) for the values that a leaf lists: those whose bounds touch its cell or, with CutValues::kAtNode,
  // those that no plane cuts. Precondition: has_cell(leaf).
  template <class Fn>
  void for_each_in_leaf(CellNumber leaf, const Fn& fn) const {
    for (const uint32_t slot : space()[space().node_of(leaf)].references) fn(values_.entries()[slot].value);
  }

  // Calls fn(leaf, begin, end) for the leaves along the ray, from 0 to ray.t_max, with the range of t in the leaf's
  // cell. Each range begins where the one before it ended, up to rounding of planes that the ray crosses together.
  // Ends if fn() returns false.
  template <class Fn>
  void leaves_on_ray(const Rayd& ray, const Fn& fn) const {
    using Next = BspSpace::Next;
    space().visit_along(ray, {0, ray.t_max}, exact_spans, [&](uint32_t index, RaySpan span) {
      if (!space()[index].is_leaf()) return Next::kDescend;
      return fn(space().number(index), span.begin, span.end) ? Next::kDescend : Next::kEnd;
    });
  }

  // Calls fn(leaf) for all leaves, such that from `eye` no leaf hides part of a leaf before it. Ends if fn() returns
  // false. O(nodes).
  template <class Fn>
  void visit_front_to_back(const Vec3d& eye, const Fn& fn) const {
    space().visit_from(eye, EyeOrder::kFrontToBack, [&](uint32_t index) { return fn(space().number(index)); });
  }

  // Calls fn(leaf) for all leaves, such that from `eye` no leaf hides part of a leaf after it: the painter's order.
  // Ends if fn() returns false. O(nodes).
  template <class Fn>
  void visit_back_to_front(const Vec3d& eye, const Fn& fn) const {
    space().visit_from(eye, EyeOrder::kBackToFront, [&](uint32_t index) { return fn(space().number(index)); });
  }

 private:
  static constexpr double kEndless = std::numeric_limits<double>::infinity();

  const BspSpace& space() const { return values_.space(); }

  template <class Accepts, class Visitor>
  bool pass(const BspNode& node, const Accepts& accepts, PassedValues& passed, Visitor& visitor, Work& work) const {
    const PassEach each = planted(PlantedBug::kBspPassedTwice) ? PassEach::kAtEveryNode : PassEach::kOnce;
    return values_.entries().pass(node.references, accepts, visitor, passed, work, each);
  }

  BspValues<V, T> values_;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BSP_TREE_BSP_TREE_H_
