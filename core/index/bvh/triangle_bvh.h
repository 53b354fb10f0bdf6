// The bounding volume hierarchy over one mesh's triangles, in the layout that the vector kernels read. As an index it
// hands triangles to visitors, like Bvh; whoever only wants a ray's first hit, or whether there is one, asks the
// kernels of ray_kernels.h for tree().
//
// Threads: immutable after build(); every member may run concurrently.
// Invariants: as Bvh's. Every block's box is its child slot's box, and every box contains its triangles.
#ifndef LOCUS_CORE_INDEX_BVH_TRIANGLE_BVH_H_
#define LOCUS_CORE_INDEX_BVH_TRIANGLE_BVH_H_

#include <limits>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/base/planted_bug.h"
#include "core/geometry/triangle.h"
#include "core/index/bvh/box_distances.h"
#include "core/index/bvh/bvh_build.h"
#include "core/index/bvh/tree_topology.h"
#include "core/index/bvh/triangle_tree.h"
#include "core/index/bvh/triangle_writer.h"
#include "core/index/spatial_index.h"

namespace locus {

class TriangleBvh {
 public:
  using Value = Triangle;

  // An empty tree.
  TriangleBvh() = default;

  // Numbers must be unique; no triangles is legal. Errors: as build_bvh_layout().
  static absl::StatusOr<TriangleBvh> build(absl::Span<const Triangle> triangles, const BvhOptions& options = {});
  // The same tree again from what outline() gave, of triangles whose numbers are 0 to triangle_count - 1 and whose
  // vertices are finite: O(n) and several times faster. From any other outline of so many triangles a tree that answers
  // as right, if slower. Errors: as restore_arrays().
  static absl::StatusOr<TriangleBvh> restore(const TreeTopology& topology, uint32_t triangle_count,
                                             absl::FunctionRef<Triangle(uint32_t)> triangle,
                                             const BvhOptions& options = {});

  size_t size() const { return arrays_.triangle_count; }
  // The triangle at a position of the storage order, which input and options fix, or the outline. Position below
  // size().
  Triangle at(size_t position) const;
  // Of all triangles; empty for none.
  const Aabbf& bounds() const { return bounds_; }
  uint32_t depth() const { return arrays_.depth; }
  size_t node_count() const { return arrays_.node_count; }
  size_t block_count() const { return arrays_.block_count; }
  // One of a block, which is one of tree(); place below the block's count.
  Triangle triangle(const TriangleBlock& block, uint32_t place) const;
  // All memory that stays taken besides the object itself.
  size_t bytes() const;
  // As Bvh::sah_cost().
  double sah_cost() const;
  // Not for an empty tree. Valid while this object stands.
  TreeTopology topology() const { return outline_of(arrays_); }
  // Valid while this object stands unmoved. Not for an empty tree.
  TriangleTree tree() const {
    return {arrays_.nodes.get(), arrays_.ranges.get(), arrays_.blocks.get(), arrays_.numbers.get(), magnitude_};
  }

  // In storage order.
  template <class Visit>
  void for_each(Visit visit) const;

  // Near to far by the boxes of nodes. Allocates nothing.
  template <RayVisitor<Triangle> Visitor>
  void visit_ray(const SlabRay<float>& slabs, Visitor& visitor, Work& work) const;

  // In storage order; hands over only triangles whose own bounds overlap. Allocates nothing.
  template <RegionVisitor<Triangle> Visitor>
  void visit_region(Visitor& visitor, Work& work) const;

  // Nearest boxes first, by distances in float that never exceed the true ones. Allocates nothing.
  template <PointVisitor<Triangle> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const;

 private:
  struct Pending {
    uint32_t child;
    float near;
  };

  void set_bounds(const Aabbf& bounds);
  // Boxes that start exactly at the limit are wanted: a lower number may wait there.
  static bool beyond(float near, float limit) { return planted(PlantedBug::kStrictTie) ? near >= limit : near > limit; }
  static Aabbf box(const TriangleNode& node, int slot) {
    return {{node.bounds[0][slot], node.bounds[1][slot], node.bounds[2][slot]},
            {node.bounds[3][slot], node.bounds[4][slot], node.bounds[5][slot]}};
  }
  Interval<float> node_interval(const SlabRay<float>& slabs, const Aabbf& box) const;
  // Puts the children within the limit on the stack, farthest first. Returns the new top.
  static Pending* push_near(const TriangleNode& node, const float (&away)[kTreeWidth], float limit, Pending* top);
  // Puts the children the ray may hit on the stack, farthest first. Returns the new top.
  Pending* push_hit(const TriangleNode& node, const SlabRay<float>& slabs, float limit, Pending* top) const;

  absl::Span<const TriangleNode> nodes() const { return {arrays_.nodes.get(), arrays_.node_count}; }
  absl::Span<const TriangleBlock> blocks() const { return {arrays_.blocks.get(), arrays_.block_count}; }

  TriangleArrays arrays_;
  Aabbf bounds_;
  float magnitude_ = 0;
};

inline Triangle TriangleBvh::triangle(const TriangleBlock& block, uint32_t place) const {
  const auto vertex = [&](int first) {
    return Vec3f{block.vertices[first][place], block.vertices[first + 1][place], block.vertices[first + 2][place]};
  };
  return {vertex(0), vertex(3), vertex(6), arrays_.numbers[block.first + place]};
}

template <class Visit>
void TriangleBvh::for_each(Visit visit) const {
  for (const TriangleBlock& block : blocks()) {
    for (uint32_t place = 0; place < block.count; ++place) visit(triangle(block, place));
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
    // The limit may have fallen since the push.
    if (beyond(now.near, visitor.limit())) continue;
    if ((now.child & kBlockBit) == 0) {
      ++work.nodes;
      top = push_hit(arrays_.nodes[now.child], slabs, visitor.limit(), top);
      continue;
    }
    const TriangleBlock& block = arrays_.blocks[now.child & ~kBlockBit];
    for (uint32_t place = 0; place < block.count; ++place) {
      ++work.tests;
      if (!visitor.visit(triangle(block, place))) return;
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
      // Blocks are taken before nodes: in storage order.
      for (const uint32_t kind : {uint32_t{0}, kBlockBit}) {
        for (int slot = kTreeWidth; slot-- > 0;) {
          const uint32_t child = node.child[slot];
          if ((child & kBlockBit) == kind && child != kNoChild && visitor.overlaps(box(node, slot))) *top++ = child;
        }
      }
      continue;
    }
    const TriangleBlock& block = arrays_.blocks[now & ~kBlockBit];
    for (uint32_t place = 0; place < block.count; ++place) {
      const Triangle candidate = triangle(block, place);
      if (!visitor.overlaps(bounds_of(candidate))) continue;
      ++work.tests;
      if (!visitor.visit(candidate)) return;
    }
  }
}

template <PointVisitor<Triangle> Visitor>
void TriangleBvh::visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
  if (size() == 0) return;
  const BoxDistances distances(point);
  Pending stack[kTreeStack];
  Pending* top = stack;
  *top++ = {0, 0};
  double limit = visitor.limit();
  float near = distances.limit(limit);
  const auto update_limit = [&] {
    if (visitor.limit() == limit) return;
    limit = visitor.limit();
    near = distances.limit(limit);
  };
  float away[kTreeWidth];
  while (top != stack) {
    const Pending now = *--top;
    if (now.near > near) continue;
    if ((now.child & kBlockBit) == 0) {
      ++work.nodes;
      const TriangleNode& node = arrays_.nodes[now.child];
      distances.to_boxes(node.bounds, away);
      top = push_near(node, away, near, top);
      continue;
    }
    const TriangleBlock& block = arrays_.blocks[now.child & ~kBlockBit];
    distances.to_triangles(block.vertices, away);
    for (uint32_t place = 0; place < block.count; ++place) {
      if (away[place] > near) continue;
      ++work.tests;
      if (!visitor.visit(triangle(block, place))) return;
      update_limit();
    }
  }
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TRIANGLE_BVH_H_
