// Bounding volume hierarchy over the triangles of one mesh, in the layout that the vector kernels read. TriangleBvh has
// the same visit functions as Bvh, and also visit functions for a path and for a half line. All visit functions pass
// triangles to visitors (spatial_index.h). Callers that need no visitor pass tree() to the faster vector kernels in
// kernels/.
//
// Threads: immutable after build() or restore(); every member may run concurrently.
// Invariants: the box of a child slot contains all triangles below it; the depth is at most limits::kMaxBvhDepth;
// nodes, blocks and triangles are stored in the depth-first order described in triangle_tree.h.
#ifndef LOCUS_CORE_INDEX_BVH_TRIANGLE_BVH_H_
#define LOCUS_CORE_INDEX_BVH_TRIANGLE_BVH_H_

#include <bit>
#include <limits>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/triangle.h"
#include "core/index/bvh/box_distances.h"
#include "core/index/bvh/bvh_build.h"
#include "core/index/bvh/half_line_boxes.h"
#include "core/index/bvh/path_boxes.h"
#include "core/index/bvh/tree_topology.h"
#include "core/index/bvh/triangle_tree.h"
#include "core/index/bvh/triangle_writer.h"
#include "core/index/spatial_index.h"

namespace locus {

class TriangleBvh {
 public:
  using Value = Triangle;
  using Traits = PrimitiveTraits<Triangle>;

  // Makes an empty tree.
  TriangleBvh() = default;

  // Builds a tree of `triangles`, whose triangle numbers must be unique; an empty span is legal. Returns the errors of
  // build_bvh_layout().
  static absl::StatusOr<TriangleBvh> build(absl::Span<const Triangle> triangles, const BvhOptions& options = {});
  // Restores a tree from its topology(). `triangle` returns the triangle of each number below `triangle_count`; the
  // vertices must be finite. O(n), several times faster than build(). The topology of any other tree with
  // `triangle_count` triangles is legal too: answers stay correct, but queries may be slower. Returns the errors of
  // restore_arrays().
  static absl::StatusOr<TriangleBvh> restore(const TreeTopology& topology, uint32_t triangle_count,
                                             absl::FunctionRef<Triangle(uint32_t)> triangle,
                                             const BvhOptions& options = {});

  size_t size() const { return arrays_.triangle_count; }
  // Returns the triangle at `position` in storage order. The input and options of the build, or the topology, determine
  // this order. Precondition: `position` < size(). O(log n).
  Triangle at(size_t position) const;
  // Returns the box around all triangles; an empty box for an empty tree.
  const Aabbf& bounds() const { return bounds_; }
  uint32_t depth() const { return arrays_.depth; }
  size_t node_count() const { return arrays_.node_count; }
  size_t block_count() const { return arrays_.block_count; }
  // Returns the triangle in lane `lane` of `block`, which must be a block of this tree. Precondition: `lane` <
  // block.count.
  Triangle triangle(const TriangleBlock& block, uint32_t lane) const;
  // Returns the size in bytes of the memory allocated by this object; sizeof(TriangleBvh) is not included.
  size_t bytes() const;
  // Returns the expected number of nodes and blocks opened by a random ray, computed like Bvh::sah_cost().
  double sah_cost() const;
  // Returns the topology of this tree. Its triangle numbers are borrowed from this object. The tree must not be empty.
  TreeTopology topology() const { return topology_of(arrays_); }
  // Returns a view of the nodes, ranges, blocks and triangle numbers, valid until this object is moved or destroyed.
  // The tree must not be empty.
  TriangleTree tree() const {
    LOCUS_DCHECK_LT(0u, size());
    return {arrays_.nodes.get(), arrays_.ranges.get(), arrays_.blocks.get(), arrays_.numbers.get(), magnitude_};
  }

  // Calls `visit` for each triangle in storage order.
  template <class Visit>
  void for_each(Visit visit) const;

  // Passes candidates to `visitor` roughly in the order in which the ray enters their blocks. Allocates no memory.
  template <RayVisitor<Triangle> Visitor>
  void visit_ray(const SlabRay<float>& slabs, Visitor& visitor, Work& work) const;

  // Passes to `visitor` the triangles whose own boxes `path` enters at a t of at most visitor.limit(), roughly from
  // near to far. Precondition: the magnitude given to `path` is the largest |coordinate| of bounds(). Allocates no
  // memory.
  template <RayVisitor<Triangle> Visitor>
  void visit_path(const PathBoxes& path, Visitor& visitor, Work& work) const;

  // Returns the half line from `point` that is expected to meet the fewest boxes of nodes and blocks.
  HalfLine cheapest_half_line(const Vec3d& point) const;
  // Passes to visitor.visit() the triangles whose own bounds the half line meets, until visit() returns false. The
  // kernels of crossing_kernels.h visit the same triangles in the same order. Allocates no memory.
  template <class Visitor>
  void visit_half_line(const HalfLineBoxes& line, Visitor& visitor, Work& work) const;

  // Passes to `visitor` the triangles whose own bounds visitor.overlaps() accepts, in storage order. Allocates no
  // memory.
  template <RegionVisitor<Triangle> Visitor>
  void visit_region(Visitor& visitor, Work& work) const;

  // Passes candidates to `visitor`, roughly nearest first. Culls using float distances to boxes; BoxDistances raises
  // the limit by the error of these distances, so that no triangle within visitor.limit() is culled. Allocates no
  // memory.
  template <PointVisitor<Triangle> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const;

 private:
  // Maximum number of pending children in a visit. kTreeStack is larger by kTreeWidth, because vector code may write
  // that many elements beyond the last pending child.
  static constexpr int kMaxPending = kTreeStack - kTreeWidth;

  struct Pending {
    uint32_t child;
    float near;
  };

  // Sets bounds_, magnitude_ and boxes_a_unit_. Precondition: arrays_ is complete.
  void set_bounds(const Aabbf& bounds);
  // Verifies, in debug builds, the storage order of nodes, blocks and triangles, and the ranges, boxes and slot orders
  // of all nodes. O(size).
  void check_invariants() const;
  void check_node(uint32_t index) const;
  // Returns whether a box that the ray enters at `near` can be skipped. A box with `near` equal to `limit` cannot be
  // skipped: it may hold a hit at the same t with a lower triangle number, which is preferred.
  static bool beyond(float near, float limit) { return planted(PlantedBug::kStrictTie) ? near >= limit : near > limit; }
  static Aabbf box(const TriangleNode& node, int slot) {
    return {{node.bounds[0][slot], node.bounds[1][slot], node.bounds[2][slot]},
            {node.bounds[3][slot], node.bounds[4][slot], node.bounds[5][slot]}};
  }
  Interval<float> node_interval(const SlabRay<float>& slabs, const Aabbf& box) const;
  // Pushes the children whose distance is at most `limit`; distances[slot] is the distance of the child in `slot`: the
  // squared distance from a point, or the t at which a path enters. The nearest child is pushed last, so that it is
  // popped first. Returns the new top of the stack.
  static Pending* push_near(const TriangleNode& node, const float (&distances)[kTreeWidth], float limit, Pending* top);
  // Pushes the children that the ray may hit at t <= `limit`, the nearest child last. Returns the new top of the stack.
  Pending* push_hit(const TriangleNode& node, const SlabRay<float>& slabs, float limit, Pending* top) const;

  absl::Span<const TriangleNode> nodes() const { return {arrays_.nodes.get(), arrays_.node_count}; }
  absl::Span<const TriangleBlock> blocks() const { return {arrays_.blocks.get(), arrays_.block_count}; }

  TriangleArrays arrays_;
  Aabbf bounds_;
  float magnitude_ = 0;
  // For each axis: how many boxes of nodes and blocks a random line is expected to meet per unit of its length within
  // bounds(). The line passes through bounds() and is parallel to the axis.
  Vec3d boxes_a_unit_;
};

inline Triangle TriangleBvh::triangle(const TriangleBlock& block, uint32_t lane) const {
  LOCUS_DCHECK_LT(lane, block.count);
  const auto vertex = [&](int first) {
    return Vec3f{block.vertices[first][lane], block.vertices[first + 1][lane], block.vertices[first + 2][lane]};
  };
  return {vertex(0), vertex(3), vertex(6), arrays_.numbers[block.first + lane]};
}

template <class Visit>
void TriangleBvh::for_each(Visit visit) const {
  for (const TriangleBlock& block : blocks()) {
    for (uint32_t lane = 0; lane < block.count; ++lane) visit(triangle(block, lane));
  }
}

template <RayVisitor<Triangle> Visitor>
void TriangleBvh::visit_ray(const SlabRay<float>& slabs, Visitor& visitor, Work& work) const {
  if (size() == 0) return;
  Pending stack[kTreeStack];
  Pending* top = stack;
  *top++ = {0, -std::numeric_limits<float>::infinity()};
  while (top != stack) {
    const Pending now = *--top;
    // The limit may have decreased since the push.
    if (beyond(now.near, visitor.limit())) continue;
    if ((now.child & kBlockBit) == 0) {
      ++work.nodes;
      top = push_hit(arrays_.nodes[now.child], slabs, visitor.limit(), top);
      LOCUS_DCHECK_LE(top - stack, kMaxPending);
      continue;
    }
    const TriangleBlock& block = arrays_.blocks[now.child & ~kBlockBit];
    for (uint32_t lane = 0; lane < block.count; ++lane) {
      ++work.tests;
      if (!visitor.visit(triangle(block, lane))) return;
    }
  }
}

template <RayVisitor<Triangle> Visitor>
void TriangleBvh::visit_path(const PathBoxes& path, Visitor& visitor, Work& work) const {
  if (size() == 0) return;
  Pending stack[kTreeStack];
  Pending* top = stack;
  *top++ = {0, -std::numeric_limits<float>::infinity()};
  float nears[kTreeWidth];
  while (top != stack) {
    const Pending now = *--top;
    // The limit may have decreased since the push.
    if (now.near > visitor.limit()) continue;
    if ((now.child & kBlockBit) == 0) {
      ++work.nodes;
      const TriangleNode& node = arrays_.nodes[now.child];
      path.to_boxes(node.bounds, nears);
      top = push_near(node, nears, std::min(visitor.limit(), std::numeric_limits<float>::max()), top);
      LOCUS_DCHECK_LE(top - stack, kMaxPending);
      continue;
    }
    const TriangleBlock& block = arrays_.blocks[now.child & ~kBlockBit];
    path.to_triangles(block.vertices, nears);
    for (uint32_t lane = 0; lane < block.count; ++lane) {
      if (nears[lane] == PathBoxes::kMissed || nears[lane] > visitor.limit()) continue;
      ++work.tests;
      if (!visitor.visit(triangle(block, lane))) return;
    }
  }
}

template <class Visitor>
void TriangleBvh::visit_half_line(const HalfLineBoxes& line, Visitor& visitor, Work& work) const {
  if (size() == 0) return;
  uint32_t nodes[kTreeStack], blocks[kMaxLineBlocks];
  uint32_t top = 0, found = 0;
  nodes[top++] = 0;
  while (top != 0) {
    for (found = 0; top != 0 && found <= kMaxLineBlocks - kTreeWidth;) {
      const TriangleNode& node = arrays_.nodes[nodes[--top]];
      ++work.nodes;
      const uint32_t met = line.boxes_met(node.bounds);
      for (int slot = kTreeWidth; slot-- > 0;) {
        if ((met >> slot & 1) == 0) continue;
        const uint32_t child = node.child[slot];
        ((child & kBlockBit) != 0 ? blocks[found++] : nodes[top++]) = child & ~kBlockBit;
      }
      LOCUS_DCHECK_LE(top, uint32_t{kMaxPending});
    }
    for (uint32_t i = 0; i < found; ++i) {
      const TriangleBlock& block = arrays_.blocks[blocks[i]];
      for (uint32_t met = line.triangles_met(block.vertices) & ((1u << block.count) - 1); met != 0; met &= met - 1) {
        ++work.tests;
        if (!visitor.visit(triangle(block, static_cast<uint32_t>(std::countr_zero(met))))) return;
      }
    }
  }
}

template <RegionVisitor<Triangle> Visitor>
void TriangleBvh::visit_region(Visitor& visitor, Work& work) const {
  if (size() == 0) return;
  uint32_t stack[kTreeStack];
  uint32_t* top = stack;
  *top++ = 0;
  while (top != stack) {
    const uint32_t now = *--top;
    if ((now & kBlockBit) == 0) {
      ++work.nodes;
      const TriangleNode& node = arrays_.nodes[now];
      // Nodes are pushed first, so that blocks are popped before nodes, which is the storage order.
      for (const uint32_t kind : {uint32_t{0}, kBlockBit}) {
        for (int slot = kTreeWidth; slot-- > 0;) {
          const uint32_t child = node.child[slot];
          if ((child & kBlockBit) == kind && child != kNoChild && visitor.overlaps(box(node, slot))) *top++ = child;
        }
      }
      LOCUS_DCHECK_LE(top - stack, kMaxPending);
      continue;
    }
    const TriangleBlock& block = arrays_.blocks[now & ~kBlockBit];
    for (uint32_t lane = 0; lane < block.count; ++lane) {
      const Triangle candidate = triangle(block, lane);
      if (!visitor.overlaps(bounds_of(candidate))) continue;
      ++work.tests;
      if (!visitor.visit(candidate)) return;
    }
  }
}

template <PointVisitor<Triangle> Visitor>
void TriangleBvh::visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
  if (size() == 0) return;
  const BoxDistances box_distances(point);
  Pending stack[kTreeStack];
  Pending* top = stack;
  *top++ = {0, 0};
  double limit = visitor.limit();
  float near = box_distances.limit(limit);
  const auto update_limit = [&] {
    if (visitor.limit() == limit) return;
    limit = visitor.limit();
    near = box_distances.limit(limit);
  };
  float distances[kTreeWidth];
  while (top != stack) {
    const Pending now = *--top;
    if (now.near > near) continue;
    if ((now.child & kBlockBit) == 0) {
      ++work.nodes;
      const TriangleNode& node = arrays_.nodes[now.child];
      box_distances.to_boxes(node.bounds, distances);
      top = push_near(node, distances, near, top);
      LOCUS_DCHECK_LE(top - stack, kMaxPending);
      continue;
    }
    const TriangleBlock& block = arrays_.blocks[now.child & ~kBlockBit];
    box_distances.to_triangles(block.vertices, distances);
    for (uint32_t lane = 0; lane < block.count; ++lane) {
      if (distances[lane] > near) continue;
      ++work.tests;
      if (!visitor.visit(triangle(block, lane))) return;
      update_limit();
    }
  }
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TRIANGLE_BVH_H_
