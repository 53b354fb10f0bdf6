// Tree of balls over values that do not change. Each node has a ball that contains the bounds of all values below it.
// A ball is tested with fewer comparisons than a box and is the same after a rotation, but is larger: queries do more
// work than in a tree of boxes. The shape of the tree is that of the binary tree over boxes (binary_tree.h).
//
// Balls are computed and compared in double. Radii are rounded outward: the distance to the farthest corner of bounds
// has a relative error below 2^-50. Tests take the opposite error bound: a node is skipped only if a distance exceeds
// the radius by more than the rounding error of the test, 2^-48 of the squares that are compared. So no value is lost
// that the visit's condition requires.
//
// Threads: immutable after build(); every member may run concurrently. Invariants: the ball of a node contains the
// bounds of its values; the two children of a node partition its values; depth <= limits::kMaxBvhDepth.
// Sources: Palmer and Grimsdale, Collision Detection for Animation using Sphere-Trees, 1995; Hubbard, Approximating
// Polyhedra with Spheres for Time-Critical Collision Detection, 1996.
#ifndef LOCUS_CORE_INDEX_SPHERE_TREE_SPHERE_TREE_H_
#define LOCUS_CORE_INDEX_SPHERE_TREE_SPHERE_TREE_H_

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/planted_bug.h"
#include "core/base/status_macros.h"
#include "core/index/binary_tree.h"
#include "core/index/padded_ray.h"
#include "core/index/spatial_index.h"

namespace locus {

struct SphereTreeShape {
  size_t nodes = 0;       // inner nodes and leaves
  size_t references = 0;  // values in leaves: each value once
  uint32_t depth = 0;     // number of levels of nodes
};

template <class V, class T = PrimitiveTraits<V>>
requires Bounded<V, T>
class SphereTree {
  using S = typename T::Scalar;

 public:
  using Value = V;
  using Traits = T;

  // Makes an empty tree.
  SphereTree() = default;

  // Builds a tree of `values`, whose ids must be unique. Returns INVALID_ARGUMENT if the bounds of a value are empty or
  // not finite, options.bins is out of range, or there are more than limits::kMaxBvhValues values; CANCELLED if the
  // cancel flag was set. Cost: that of the binary tree, and O(n * depth) for the balls.
  static absl::StatusOr<SphereTree> build(std::vector<V> values, const BvhOptions& options = {}) {
    RETURN_IF_ERROR(check_build(values.size(), options));
    SphereTree tree;
    if (values.empty()) return tree;
    const auto count = static_cast<uint32_t>(values.size());
    auto references = std::make_unique_for_overwrite<BoxReference<S>[]>(count);
    for (uint32_t i = 0; i < count; ++i) {
      const Aabb<S> bounds = Traits::bounds(values[i]);
      if (!is_finite(bounds.min) || !is_finite(bounds.max) || bounds.empty()) return refuse_bounds(i);
      references[i] = BoxReference<S>::of(QuadBox<S>::of(bounds), i);
    }
    ASSIGN_OR_RETURN(BinaryTree<S> binary, BinaryTree<S>::build(std::move(references), count, options));
    tree.entries_.reserve(count);
    for (uint32_t position = 0; position < count; ++position) {
      V& value = values[binary.index(position)];
      const Aabb<S> bounds = Traits::bounds(value);
      tree.entries_.push_back({std::move(value), bounds});
    }
    tree.magnitude_ = magnitude(binary.root().bounds);
    tree.make_nodes(binary.root());
    LOCUS_DCHECK_CALL(tree.check_invariants());
    return tree;
  }

  size_t size() const { return entries_.size(); }
  SphereTreeShape shape() const { return {nodes_.size(), entries_.size(), depth_}; }

  // Passes candidates to `visitor` roughly in the order in which the ray enters the balls: the nearer of two children
  // first. Allocates no memory.
  template <RayVisitor<V, T> Visitor>
  void visit_ray(const SlabRay<S>& slabs, Visitor& visitor, Work& work) const {
    const PaddedRay ray(slabs, magnitude_);
    const auto entry = [&ray](const Node& node) { return entry_of(node, ray); };
    const auto in_reach = [&](double distance) { return distance <= ray.reach(visitor.limit()); };
    visit_nearest_first(
        entry, in_reach, [](const Aabb<S>&) { return true; }, visitor, work);
  }

  // Passes to `visitor` the values whose own bounds visitor.overlaps() accepts. Allocates no memory.
  template <RegionVisitor<V, T> Visitor>
  void visit_region(Visitor& visitor, Work& work) const {
    const Aabbd region = to_double(visitor.bounds());
    // A node that is not skipped has the distance 0, so that the children of a node are visited in order.
    const auto entry = [&region](const Node& node) -> std::optional<double> {
      if (squared_distance(node.center, region) > node.squared_reach) return std::nullopt;
      return 0.0;
    };
    const auto accepts = [&visitor](const Aabb<S>& bounds) { return visitor.overlaps(bounds); };
    visit_nearest_first(
        entry, [](double) { return true; }, accepts, visitor, work);
  }

  // Passes to `visitor` the values whose own bounds have a squared distance of at most visitor.limit() from `point`,
  // roughly nearest first. Allocates no memory.
  template <PointVisitor<V, T> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
    // Returns a lower bound of the squared_distance() from `point` to all bounds in the ball.
    const auto entry = [&point](const Node& node) -> std::optional<double> {
      const double gap = std::sqrt(squared_length(point - node.center)) * (1 - 0x1p-50) - node.radius;
      return gap > 0 ? gap * gap * (1 - 0x1p-48) : 0.0;
    };
    const auto in_reach = [&visitor](double squared) { return !(squared > visitor.limit()); };
    const auto accepts = [&](const Aabb<S>& bounds) {
      return squared_distance(point, to_double(bounds)) <= visitor.limit();
    };
    visit_nearest_first(entry, in_reach, accepts, visitor, work);
  }

 private:
  static constexpr double kUnderflow = 0x1p-500;  // more than the errors of squares that underflow

  struct Node {
    Vec3d center;
    double radius;
    double squared_reach;   // squared distances above this are outside of the ball, whatever the rounding
    uint32_t right;         // index of the right child; the left child is the next node; 0 for a leaf
    uint32_t first, count;  // range of the node's values in entries_

    bool is_leaf() const { return right == 0; }
  };
  struct Entry {
    V value;
    Aabb<S> bounds;
  };

  // Copies the binary tree to nodes_, parents before children, left before right.
  void make_nodes(const BinaryNode<S>& root) {
    struct Unwritten {
      const BinaryNode<S>* node;
      uint32_t parent;  // node whose right child this is; kNoParent for a left child and the root
      uint32_t depth;
    };
    std::vector<Unwritten> pending = {{&root, kNoParent, 1}};
    while (!pending.empty()) {
      const Unwritten now = pending.back();
      pending.pop_back();
      const auto index = static_cast<uint32_t>(nodes_.size());
      if (now.parent != kNoParent) nodes_[now.parent].right = index;
      nodes_.push_back(node_around(*now.node));
      depth_ = std::max(depth_, now.depth);
      if (now.node->is_leaf()) continue;
      pending.push_back({&now.node->children[1], index, now.depth + 1});
      pending.push_back({&now.node->children[0], kNoParent, now.depth + 1});
    }
  }

  // Returns a leaf with the smallest ball, around the centre of the bounds, that contains the bounds of all values.
  Node node_around(const BinaryNode<S>& binary) const {
    const Aabbd box = to_double(binary.bounds);
    const Vec3d center = box.min * 0.5 + box.max * 0.5;
    double squared = 0;
    for (const Entry& entry : absl::MakeConstSpan(entries_).subspan(binary.first, binary.count)) {
      const Aabbd bounds = to_double(entry.bounds);
      const Vec3d far = planted(PlantedBug::kSphereCenters) ? abs((bounds.min + bounds.max) * 0.5 - center)
                                                            : max(abs(bounds.min - center), abs(bounds.max - center));
      squared = std::max(squared, squared_length(far));
    }
    const double radius = std::sqrt(squared) * (1 + 0x1p-50) + kUnderflow;
    return {center, radius, radius * radius * (1 + 0x1p-48), 0, binary.first, binary.count};
  }

  // Returns the distance at which the padded ray enters the ball, which may be negative, or nullopt if it does not.
  static std::optional<double> entry_of(const Node& node, const PaddedRay& ray) {
    const Vec3d offset = node.center - ray.origin();
    const double along = dot(offset, ray.unit());
    const double radius = node.radius + ray.pad();
    const double half = radius * radius - squared_length(offset - ray.unit() * along);
    if (half < 0) return std::nullopt;
    const double chord = std::sqrt(half) + ray.pad();
    if (along + chord < 0) return std::nullopt;
    return along - chord;
  }

  struct Pending {
    uint32_t node;
    double distance;
  };

  // Visits nodes depth first, the child with the smaller distance first. `entry` returns the distance of a node, or
  // nullopt if it can be skipped. A node is also skipped if in_reach(distance) is false when its turn comes.
  template <class EntryOf, class InReach, class Accepts, class Visitor>
  void visit_nearest_first(const EntryOf& entry, const InReach& in_reach, const Accepts& accepts, Visitor& visitor,
                           Work& work) const {
    if (nodes_.empty()) return;
    absl::InlinedVector<Pending, limits::kMaxBvhDepth + 1> pending;
    const auto push = [&](uint32_t node) {
      if (const std::optional<double> distance = entry(nodes_[node])) pending.push_back({node, *distance});
    };
    push(0);
    while (!pending.empty()) {
      const Pending now = pending.back();
      pending.pop_back();
      if (!in_reach(now.distance)) continue;
      const Node& node = nodes_[now.node];
      ++work.nodes;
      if (node.is_leaf()) {
        if (!pass(node, accepts, visitor, work)) return;
        continue;
      }
      const size_t before = pending.size();
      push(node.right);
      push(now.node + 1);
      if (pending.size() == before + 2 && pending[before].distance < pending[before + 1].distance)
        std::swap(pending[before], pending[before + 1]);
    }
  }

  // Passes the values of a leaf whose bounds are accepted. Adds the values of the leaf to work.cells, and those that
  // are passed to work.tests. Returns false if the visitor has ended the visit.
  template <class Accepts, class Visitor>
  bool pass(const Node& leaf, const Accepts& accepts, Visitor& visitor, Work& work) const {
    work.cells += leaf.count;
    for (uint32_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
      if (!accepts(entries_[i].bounds)) continue;
      ++work.tests;
      if (!visitor.visit(entries_[i].value)) return false;
    }
    return true;
  }

  // Verifies, in debug builds, that children partition the values of their parent, and the limits of the tree.
  // O(nodes).
  void check_invariants() const {
    LOCUS_DCHECK_LE(depth_, limits::kMaxBvhDepth);
    LOCUS_DCHECK_LT(nodes_.size(), 2 * entries_.size());
    for (uint32_t i = 0; i < nodes_.size(); ++i) {
      const Node& node = nodes_[i];
      LOCUS_DCHECK_LE(node.first + node.count, entries_.size());
      if (node.is_leaf()) continue;
      LOCUS_DCHECK_EQ(nodes_[i + 1].first, node.first);
      LOCUS_DCHECK_EQ(nodes_[node.right].first, node.first + nodes_[i + 1].count);
      LOCUS_DCHECK_EQ(nodes_[i + 1].count + nodes_[node.right].count, node.count);
    }
  }

  static constexpr uint32_t kNoParent = 0xFFFFFFFFu;

  std::vector<Node> nodes_;
  std::vector<Entry> entries_;  // in the order of the leaves
  S magnitude_ = 0;             // largest |coordinate| of all bounds
  uint32_t depth_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_SPHERE_TREE_SPHERE_TREE_H_
