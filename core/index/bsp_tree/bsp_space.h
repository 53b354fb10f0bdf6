// Binary division of all of space by planes into convex cells. Each node has a cell; an inner node has a plane, which
// divides its cell into those of its two children. The cells of the leaves fill space: every point belongs to exactly
// one of them. Nodes list references to values, small integers; BspTree stores the values.
//
// A cell has a number that denotes it for ever: if a leaf is divided, its number stays that of the undivided cell, and
// numbers of cells that were joined are never used again.
//
// Threads: const members may run concurrently; the others need exclusive use. Invariants: nodes in use are the root and
// all nodes below it; the depth is at most limits::kMaxBspDepth, which bounds every stack.
// Source: Fuchs, Kedem, Naylor, On Visible Surface Generation by A Priori Tree Structures, 1980.
#ifndef LOCUS_CORE_INDEX_BSP_TREE_BSP_SPACE_H_
#define LOCUS_CORE_INDEX_BSP_TREE_BSP_SPACE_H_

#include <cstdint>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/index/bsp_tree/plane_sides.h"

namespace locus {

// Number of a cell. The low 32 bits are the index of its node, and the high 32 bits count how often the node was used
// for another cell before, so that the numbers of a tree that was only built are small.
using CellNumber = uint64_t;

// Order in which the two sides of a plane are visited from an eye.
enum class EyeOrder : uint8_t { kFrontToBack, kBackToFront };

struct BspNode {
  static constexpr uint32_t kRoot = 0;
  static constexpr uint32_t kNotInUse = 0xFFFFFFFFu;

  Plane plane;          // of an inner node
  uint32_t child = 0;   // child in front of the plane; the child behind it is the next node; 0 for a leaf
  uint32_t parent = 0;  // kNotInUse for a node that is not in use
  uint32_t uses = 0;    // number of cells that the node stood for before
  uint32_t depth = 0;   // number of planes above the node
  uint32_t limit = 0;   // number of references above which a leaf should be divided
  std::vector<uint32_t> references;

  bool is_leaf() const { return child == 0; }
};

class BspSpace {
 public:
  template <class T>
  using Stack = absl::InlinedVector<T, limits::kMaxBspDepth + 1>;

  // Makes an undivided space.
  BspSpace() : nodes_(1) {}

  BspNode& operator[](uint32_t index) { return nodes_[index]; }
  const BspNode& operator[](uint32_t index) const { return nodes_[index]; }
  // Returns the number of nodes in use.
  size_t node_count() const { return nodes_.size() - 2 * free_.size(); }
  // Returns the largest number of planes above a leaf. O(nodes).
  uint32_t depth() const;

  // Divides a leaf by a plane into two leaves without references. Returns the index of the child in front.
  uint32_t divide(uint32_t leaf, const Plane& plane);
  // Removes the two children of a node, which must be leaves. The node becomes a leaf and keeps its own references.
  void join(uint32_t node);
  // Removes all planes and references.
  void clear();

  CellNumber number(uint32_t index) const { return CellNumber{nodes_[index].uses} << 32 | index; }
  // Returns whether `cell` is the number of a cell, of a leaf or an inner node.
  bool has_cell(CellNumber cell) const;
  // Returns the index of a cell's node. Precondition: has_cell(cell).
  uint32_t node_of(CellNumber cell) const;
  // Returns the index of the leaf whose cell contains `point`. O(depth).
  uint32_t leaf_of(const Vec3d& point) const;
  // Returns the planes around the cell of a node, from the node upwards. O(depth).
  std::vector<Plane> planes_around(uint32_t node) const;

  // Calls fn(index) for every leaf in the order of the distance of its cell from `eye`: a cell cannot hide, from the
  // eye, part of a cell that comes before it (kFrontToBack) or after it (kBackToFront). Ends if fn() returns false.
  template <class Fn>
  void visit_from(const Vec3d& eye, EyeOrder order, const Fn& fn) const {
    Stack<uint32_t> pending = {BspNode::kRoot};
    while (!pending.empty()) {
      const BspNode& node = nodes_[pending.back()];
      if (node.is_leaf()) {
        if (!fn(pending.back())) return;
        pending.pop_back();
        continue;
      }
      pending.pop_back();
      const bool eye_in_front = signed_distance(node.plane, eye) >= 0 || planted(PlantedBug::kBspEyeBehind);
      const bool front_first = eye_in_front == (order == EyeOrder::kFrontToBack);
      pending.push_back(front_first ? node.child + 1 : node.child);
      pending.push_back(front_first ? node.child : node.child + 1);
    }
  }

  // Calls fn(index, span) for the nodes that a ray passes, in the order of their spans, if spans(plane, ray, span)
  // returns the spans on the two sides of a plane. Ends if fn() returns kEnd; does not visit the children of a node for
  // which it returns kSkip.
  enum class Next : uint8_t { kDescend, kSkip, kEnd };
  template <class Ray, class Spans, class Fn>
  void visit_along(const Ray& ray, RaySpan whole, const Spans& spans, const Fn& fn) const {
    struct Pending {
      uint32_t index;
      RaySpan span;
    };
    Stack<Pending> pending = {{BspNode::kRoot, whole}};
    while (!pending.empty()) {
      const auto [index, span] = pending.back();
      pending.pop_back();
      const Next next = fn(index, span);
      if (next == Next::kEnd) return;
      const BspNode& node = nodes_[index];
      if (next == Next::kSkip || node.is_leaf()) continue;
      const SideSpans sides = spans(node.plane, ray, span);
      const Pending front = {node.child, sides.front}, back = {node.child + 1, sides.back};
      const Pending& first = sides.front_first ? front : back;
      const Pending& second = sides.front_first ? back : front;
      if (!second.span.empty()) pending.push_back(second);
      if (!first.span.empty()) pending.push_back(first);
    }
  }

 private:
  // Verifies, in debug builds, the links and depths of the two children of a node.
  void check_invariants(uint32_t node) const;

  std::vector<BspNode> nodes_;
  std::vector<uint32_t> free_;  // first nodes of pairs that are not in use
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BSP_TREE_BSP_SPACE_H_
