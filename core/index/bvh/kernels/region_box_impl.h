// Tests of a box with eight boxes or eight triangles at a time, for region_kernels_impl.h: separating axis tests in the
// box's own axes, as in the predicate box_overlaps(). Error bounds of the triangle test, with u = 2^-24, E = the
// block's extent, h = the half extents and, on each axis, R = h + 2 E. The box overlaps the block's box, so no
// coordinate of a vertex, relative to the centre and along the box's axes, exceeds R. All computations start with
// differences of floats, whose relative error is u, and each product and each sum counts as one rounding, as if
// compiled without fused multiply-add. If the box is not rotated:
//
// - On the axis perpendicular to a box axis and an edge (x, y), the error of a projected vertex is 4 u (|x| R_y + |y|
//   R_x): two differences, a product and a sum; the error of the projected box is the same. The padded half extents
//   `inner` and `outer`, which differ from h by 16 u R, change the projected box by twice the sum of these two errors.
//   If an edge is parallel to the box's axis, all projections are exactly zero, which counts as overlapping. Edges are
//   scaled by 2^60, so that no product underflows.
// - The error of a normal's component, which is at most E^2, is 3 u of each of its products and u of itself: 7 u E^2.
//   The error of the triangle's height is (7 + 4) u E^2 (R_x + R_y + R_z), the error of the projected box (7 + 3) u of
//   the same product, and the two sums with the bound add u each: 23 u in total, within plane = 32 u E^2 (R_x + R_y +
//   R_z).
//
// If the box is rotated, with S the sum of R: the error of coordinates, sums of three products, is 5 u S, and the error
// of edges 9 u E; `inner` and `outer` differ from h by 2^-18 S. On an axis perpendicular to an edge, the error of a
// projected vertex is 42 u E S and the error of the projected box 14 u E S; the sum is within 2^-17 E S. The error of a
// normal's component is 78 u E^2, the error of the height (78 + 26 + 9) u E^2 S, and the error of the projected box 87
// u E^2 S; the sum of the last two errors is within 2^-15 E^2 S.
//
// If the projections of a triangle certainly overlap the projections of the box on all axes, the triangle has a point
// in common with the box. Then the triangle's own bounding box, which the predicate tests too, also has a point in
// common with the box. A triangle without area is never certain unless a vertex is inside the box; such a vertex
// overlaps the box on every axis, because rounding is monotone.
//
// Source: Akenine-Moller, Fast 3D Triangle-Box Overlap Testing, 2001.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BOX_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BOX_IMPL_H_

#include "core/index/bvh/kernels/region_ball_impl.h"

namespace locus {
namespace {

static inline Vector8 min_of_three(Vector8 a, Vector8 b, Vector8 c) {
  return {minimum(a.x, minimum(b.x, c.x)), minimum(a.y, minimum(b.y, c.y)), minimum(a.z, minimum(b.z, c.z))};
}
static inline Vector8 max_of_three(Vector8 a, Vector8 b, Vector8 c) {
  return {maximum(a.x, maximum(b.x, c.x)), maximum(a.y, maximum(b.y, c.y)), maximum(a.z, maximum(b.z, c.z))};
}
static inline Vector8 absolute(Vector8 a) { return {absolute(a.x), absolute(a.y), absolute(a.z)}; }
static inline Vector8 scaled(Vector8 a, Floats8 s) { return {a.x * s, a.y * s, a.z * s}; }

// One axis-aligned box, repeated in all lanes. overlaps() and contains() test whether this box overlaps or contains
// each of eight boxes with the corners `low` and `high`.
struct Boxes8 {
  Vector8 min, max;

  inline uint32_t overlaps(Vector8 low, Vector8 high) const {
    return at_most(low.x, max.x) & at_most(min.x, high.x) & at_most(low.y, max.y) & at_most(min.y, high.y) &
           at_most(low.z, max.z) & at_most(min.z, high.z);
  }
  inline uint32_t contains(Vector8 low, Vector8 high) const {
    return at_most(min.x, low.x) & at_most(high.x, max.x) & at_most(min.y, low.y) & at_most(high.y, max.y) &
           at_most(min.z, low.z) & at_most(high.z, max.z);
  }
};

// Result masks of the separating axis test for eight triangles; one bit per triangle.
struct OverlapBits {
  uint32_t possible;  // triangles not certainly separated from the box along any axis tested so far
  uint32_t certain;   // triangles certainly not separated along any axis tested so far

  // Adds the result for one axis. `gap` is the distance between the projections of the box's centre and the triangle;
  // `inner` and `outer` are lower and upper bounds of the half extent of the box's projection.
  inline void add_axis(Floats8 gap, Floats8 inner, Floats8 outer) {
    certain &= at_most(gap, inner);
    possible &= at_most(gap, outer);
  }
};

// Box to be tested with the nodes and blocks of a tree: the template argument Query of region_kernels_impl.h.
template <bool kRotated>
class BoxQuery {
 public:
  inline void set(const KernelBox& box) {
    outer_ = {Vector8::splat(box.outer_min), Vector8::splat(box.outer_max)};
    inner_ = {Vector8::splat(box.inner_min), Vector8::splat(box.inner_max)};
    center_ = Vector8::splat(box.center);
    box_ = &box;
  }

  __attribute__((always_inline)) inline ChildResults test_node(const TriangleNode& node) const {
    const Vector8 low = Vector8::load(node.bounds), high = Vector8::load(node.bounds + 3);
    const uint32_t overlapping = outer_.overlaps(low, high);
    if constexpr (kRotated) {
      if (overlapping == 0) return {0, 0};
      const ChildResults rotated = test_rotated(low - center_, high - center_);
      return {overlapping & rotated.overlapping, overlapping & rotated.contained};
    }
    return {overlapping, overlapping & inner_.contains(low, high)};
  }

  inline TriangleResults test_block(const TriangleBlock& block) const {
    const uint32_t lanes = (1u << block.count) - 1u;
    const BlockBounds bounds(*box_, block.extent);
    if (!bounds.in_range) return {0, lanes};
    const Vector8 a = to_box_axes(Vector8::load(block.vertices) - center_),
                  b = to_box_axes(Vector8::load(block.vertices + 3) - center_),
                  c = to_box_axes(Vector8::load(block.vertices + 6) - center_);
    const Vector8 low = min_of_three(a, b, c), high = max_of_three(a, b, c);
    OverlapBits overlap = {lanes, lanes};
    const Vector8 gap = {maximum(low.x, negated(high.x)), maximum(low.y, negated(high.y)),
                         maximum(low.z, negated(high.z))};
    overlap.add_axis(gap.x, bounds.inner.x, bounds.outer.x);
    overlap.add_axis(gap.y, bounds.inner.y, bounds.outer.y);
    overlap.add_axis(gap.z, bounds.inner.z, bounds.outer.z);
    uint32_t inside = bounds.contains(a) & lanes;
    const uint32_t b_inside = bounds.contains(b), c_inside = bounds.contains(c);
    inside = (inside | b_inside | c_inside) & lanes;
    if ((overlap.possible & ~inside) == 0) return {inside, 0};

    const Vector8 ab = edge_of(block, 0, 3), bc = edge_of(block, 3, 6), ca = edge_of(block, 6, 0);
    add_normal(cross(ab, bc), a, bounds, overlap);
    if ((overlap.possible & ~inside) == 0) return {inside, 0};
    add_edge_axes(ab, a, c, bounds, overlap);
    add_edge_axes(bc, b, a, bounds, overlap);
    add_edge_axes(ca, c, b, bounds, overlap);
    const uint32_t certain = inside | (overlap.certain & overlap.possible);
    return {certain, overlap.possible & ~certain};
  }

 private:
  // Half extents of the box, exact (`half`) and padded (`inner`, `outer`), and error bounds for the triangles of one
  // block.
  struct BlockBounds {
    inline BlockBounds(const KernelBox& box, float extent) {
      float reach[3], pad[3], sum = 0;
      for (int axis = 0; axis < 3; ++axis) sum += reach[axis] = box.half[axis] + 2 * extent;
      const float min_reach = bound_unless(PlantedBug::kRegionRange, 0x1p-39f);
      in_range = reach[0] >= min_reach && reach[1] >= min_reach && reach[2] >= min_reach;
      for (int axis = 0; axis < 3; ++axis)
        pad[axis] = bound_unless(PlantedBug::kRegionHalf, kRotated ? 0x1p-18f * sum : 0x1p-20f * reach[axis]);
      half = Vector8::splat(box.half);
      const Vector8 pads = Vector8::splat(pad);
      inner = half - pads;
      outer = {half.x + pads.x, half.y + pads.y, half.z + pads.z};
      across = Floats8::splat(kRotated ? 0x1p-17f * extent * sum * kEdgeScale : 0);
      plane = Floats8::splat(bound_unless(PlantedBug::kRegionBoxPlane,
                                          (kRotated ? 0x1p-15f : 0x1p-19f) * extent * extent * sum + square_floor()));
    }
    inline uint32_t contains(Vector8 point) const {
      const Vector8 size = absolute(point);
      return at_most(size.x, inner.x) & at_most(size.y, inner.y) & at_most(size.z, inner.z);
    }

    Vector8 half, inner, outer;
    Floats8 across, plane;
    bool in_range;  // true if no product of projections can underflow
  };

  static constexpr float kEdgeScale = 0x1p60f;

  static inline Floats8 negated(Floats8 a) { return Floats8::splat(0) - a; }

  // Rotates vectors from mesh axes to box axes.
  inline Vector8 to_box_axes(Vector8 v) const {
    if constexpr (!kRotated) return v;
    const float* r = box_->rotation;
    const auto column = [&](int k) {
      return multiply_add(Floats8::splat(r[k]), v.x,
                          multiply_add(Floats8::splat(r[3 + k]), v.y, Floats8::splat(r[6 + k]) * v.z));
    };
    return {column(0), column(1), column(2)};
  }

  // Returns, in box axes, the edge from one vertex to another. `from` and `to` are the first rows of these vertices in
  // TriangleBlock::vertices.
  inline Vector8 edge_of(const TriangleBlock& block, int from, int to) const {
    return to_box_axes(Vector8::load(block.vertices + to) - Vector8::load(block.vertices + from));
  }

  // Tests the rotated box with eight boxes, using the rotated box's own axes as separating axes. `low` and `high` are
  // the corners of the eight boxes, relative to the rotated box's centre.
  inline ChildResults test_rotated(Vector8 low, Vector8 high) const {
    const Floats8 half = Floats8::splat(0.5f);
    const Vector8 middle = to_box_axes({(low.x + high.x) * half, (low.y + high.y) * half, (low.z + high.z) * half});
    const Vector8 extent = scaled(high - low, half);
    const Floats8 pad = Floats8::splat(bound_unless(PlantedBug::kRegionTurnedNode, 0x1p-19f)) *
                        (maximum(absolute(low.x), absolute(high.x)) + maximum(absolute(low.y), absolute(high.y)) +
                         maximum(absolute(low.z), absolute(high.z)));
    uint32_t overlapping = 255, contained = 255;
    const Floats8 middles[3] = {absolute(middle.x), absolute(middle.y), absolute(middle.z)};
    for (int k = 0; k < 3; ++k) {
      const float* r = box_->rotation + k;
      const Floats8 projected_extent = multiply_add(
          absolute(Floats8::splat(r[0])), extent.x,
          multiply_add(absolute(Floats8::splat(r[3])), extent.y, absolute(Floats8::splat(r[6])) * extent.z));
      const Floats8 own = Floats8::splat(box_->half[k]);
      overlapping &= at_most(middles[k] - projected_extent, own + pad);
      contained &= at_most(middles[k] + projected_extent, own - pad);
    }
    return {overlapping, contained & overlapping};
  }

  // Adds the normal of the triangle as a separating axis. `vertex` is any vertex of the triangle.
  static inline void add_normal(Vector8 normal, Vector8 vertex, const BlockBounds& bounds, OverlapBits& overlap) {
    const Floats8 height = absolute(dot(normal, vertex)), projected_half = dot(absolute(normal), bounds.half);
    overlap.add_axis(height, projected_half - bounds.plane, projected_half + bounds.plane);
  }

  // Adds three separating axes, each perpendicular to the edge and to one of the three box axes. The edge starts at
  // `from`; `other` is the opposite vertex.
  static inline void add_edge_axes(Vector8 edge, Vector8 from, Vector8 other, const BlockBounds& bounds,
                                   OverlapBits& overlap) {
    const Vector8 e = scaled(edge, Floats8::splat(planted(PlantedBug::kRegionEdgeScale) ? 1 : kEdgeScale));
    add_edge_axis(e.y, e.z, from.y, from.z, other.y, other.z, bounds.inner.y, bounds.inner.z, bounds.outer.y,
                  bounds.outer.z, bounds.across, overlap);
    add_edge_axis(e.z, e.x, from.z, from.x, other.z, other.x, bounds.inner.z, bounds.inner.x, bounds.outer.z,
                  bounds.outer.x, bounds.across, overlap);
    add_edge_axis(e.x, e.y, from.x, from.y, other.x, other.y, bounds.inner.x, bounds.inner.y, bounds.outer.x,
                  bounds.outer.y, bounds.across, overlap);
  }

  // Adds one separating axis in the plane of two box axes. Let (x, y) be the components of the edge on these two axes;
  // the separating axis is (-y, x), which is perpendicular to the edge.
  static inline void add_edge_axis(Floats8 x, Floats8 y, Floats8 from_x, Floats8 from_y, Floats8 other_x,
                                   Floats8 other_y, Floats8 inner_x, Floats8 inner_y, Floats8 outer_x, Floats8 outer_y,
                                   Floats8 across, OverlapBits& overlap) {
    const Floats8 p = multiply_subtract(x, from_y, y * from_x), q = multiply_subtract(x, other_y, y * other_x);
    const Floats8 gap = maximum(minimum(p, q), negated(maximum(p, q)));
    const Floats8 abs_x = absolute(x), abs_y = absolute(y);
    overlap.add_axis(gap, multiply_add(abs_y, inner_x, multiply_subtract(abs_x, inner_y, across)),
                     multiply_add(abs_y, outer_x, multiply_add(abs_x, outer_y, across)));
  }

  Boxes8 outer_, inner_;
  Vector8 center_;
  const KernelBox* box_;
};

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BOX_IMPL_H_
