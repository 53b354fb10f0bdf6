// Boxes against boxes and triangles, eight at a time, for region_kernels_impl.h: separating axes in the box's own axes,
// as the predicate's. The error bounds of the triangle test, with u = 2^-24, E = the block's extent, h = the half
// extents and R = h + 2 E, by axis; the box reaches the block's box, so no coordinate of a vertex, seen from the centre
// along the box's axes, is larger than R. The differences of floats, all that is computed from, are off by u of
// themselves, and every product and every sum counts as a rounding of its own, as it does without fused products. In a
// box that is not turned:
//
// - A shadow on the axis across a box axis and an edge (x, y) is off by 4 u (|x| R_y + |y| R_x): two differences, a
//   product and a sum; the box's reach as well. The shadow of half extents smaller or larger by 16 u R differs by twice
//   that. Where an edge is parallel to the box's axis, the shadows are exactly zero, and zero is in reach of zero.
//   Edges are taken 2^60 times, so that no product underflows.
// - A normal's component, at most E^2, is off by 3 u of each of its products and u of itself: 7 u E^2. The height is
// off
//   by 7 u and 4 u of E^2 (R_x + R_y + R_z), the reach by 7 u and 3 u, the sums with the bound by u each: 23 u in all,
//   and plane = 32 u of it.
//
// In a turned box, with S the sum of R, coordinates are sums of three products, off by 5 u S, and edges by 9 u E: half
// extents differ by 2^-18 S. Across an edge a shadow is off by 42 u E S and the reach by 14 u E S, against 2^-17 E S.
// A normal's component is off by 78 u E^2, the height by 78 u, 26 u and 9 u of E^2 S, the reach by 87 u, against
// 2^-15 E^2 S.
//
// What is certain to overlap on all axes has a point in common with the box, and so has its bounds; triangles without
// area never are, but where they lie inside: a vertex inside is in reach on every axis, by monotone rounding.
//
// Source: Akenine-Moller, Fast 3D Triangle-Box Overlap Testing, 2001.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BOX_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BOX_IMPL_H_

#include "core/index/bvh/kernels/region_ball_impl.h"

namespace locus {
namespace {

static inline Vector8 smallest(Vector8 a, Vector8 b, Vector8 c) {
  return {minimum(a.x, minimum(b.x, c.x)), minimum(a.y, minimum(b.y, c.y)), minimum(a.z, minimum(b.z, c.z))};
}
static inline Vector8 largest(Vector8 a, Vector8 b, Vector8 c) {
  return {maximum(a.x, maximum(b.x, c.x)), maximum(a.y, maximum(b.y, c.y)), maximum(a.z, maximum(b.z, c.z))};
}
static inline Vector8 absolute(Vector8 a) { return {absolute(a.x), absolute(a.y), absolute(a.z)}; }
static inline Vector8 times(Vector8 a, Floats8 s) { return {a.x * s, a.y * s, a.z * s}; }

// Whether low to high overlaps, or lies within, a box of floats.
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

// Of eight triangles, bits of those that float cannot tell to be separated from the box along an axis, and of those
// that are certain not to be.
struct Shadows {
  uint32_t possible, certain;

  inline void meet(Floats8 gap, Floats8 inner, Floats8 outer) {
    certain &= at_most(gap, inner);
    possible &= at_most(gap, outer);
  }
};

template <bool kTurned>
class BoxQuery {
 public:
  inline void set(const KernelBox& box) {
    outer_ = {Vector8::splat(box.outer_min), Vector8::splat(box.outer_max)};
    inner_ = {Vector8::splat(box.inner_min), Vector8::splat(box.inner_max)};
    center_ = Vector8::splat(box.center);
    box_ = &box;
  }

  __attribute__((always_inline)) inline MetChildren meet_node(const TriangleNode& node) const {
    const Vector8 low = Vector8::load(node.bounds), high = Vector8::load(node.bounds + 3);
    const uint32_t some = outer_.overlaps(low, high);
    if constexpr (kTurned) {
      if (some == 0) return {0, 0};
      const MetChildren turned = meet_turned(low - center_, high - center_);
      return {some & turned.some, some & turned.whole};
    }
    return {some, some & inner_.contains(low, high)};
  }

  inline MetTriangles meet_block(const TriangleBlock& block) const {
    const uint32_t all = (1u << block.count) - 1u;
    const Span span(*box_, block.extent);
    if (!span.in_range) return {0, all};
    const Vector8 a = seen(Vector8::load(block.vertices) - center_),
                  b = seen(Vector8::load(block.vertices + 3) - center_),
                  c = seen(Vector8::load(block.vertices + 6) - center_);
    const Vector8 low = smallest(a, b, c), high = largest(a, b, c);
    Shadows shadows = {all, all};
    const Vector8 gap = {maximum(low.x, minus(high.x)), maximum(low.y, minus(high.y)), maximum(low.z, minus(high.z))};
    shadows.meet(gap.x, span.inner.x, span.outer.x);
    shadows.meet(gap.y, span.inner.y, span.outer.y);
    shadows.meet(gap.z, span.inner.z, span.outer.z);
    uint32_t inside = span.contains(a) & all;
    const uint32_t b_inside = span.contains(b), c_inside = span.contains(c);
    inside = (inside | b_inside | c_inside) & all;
    if ((shadows.possible & ~inside) == 0) return {inside, 0};

    const Vector8 ab = edge_of(block, 0, 3), bc = edge_of(block, 3, 6), ca = edge_of(block, 6, 0);
    meet_normal(cross(ab, bc), a, span, shadows);
    if ((shadows.possible & ~inside) == 0) return {inside, 0};
    meet_edge(ab, a, c, span, shadows);
    meet_edge(bc, b, a, span, shadows);
    meet_edge(ca, c, b, span, shadows);
    const uint32_t sure = inside | (shadows.certain & shadows.possible);
    return {sure, shadows.possible & ~sure};
  }

 private:
  // What a block's shadows are held against.
  struct Span {
    inline Span(const KernelBox& box, float extent) {
      float reach[3], pad[3], sum = 0;
      for (int axis = 0; axis < 3; ++axis) sum += reach[axis] = box.half[axis] + 2 * extent;
      const float least = unless(PlantedBug::kRegionRange, 0x1p-39f);
      in_range = reach[0] >= least && reach[1] >= least && reach[2] >= least;
      for (int axis = 0; axis < 3; ++axis)
        pad[axis] = unless(PlantedBug::kRegionHalf, kTurned ? 0x1p-18f * sum : 0x1p-20f * reach[axis]);
      half = Vector8::splat(box.half);
      const Vector8 pads = Vector8::splat(pad);
      inner = half - pads;
      outer = {half.x + pads.x, half.y + pads.y, half.z + pads.z};
      across = Floats8::splat(kTurned ? 0x1p-17f * extent * sum * kEdgeScale : 0);
      plane = Floats8::splat(unless(PlantedBug::kRegionBoxPlane,
                                    (kTurned ? 0x1p-15f : 0x1p-19f) * extent * extent * sum + square_floor()));
    }
    inline uint32_t contains(Vector8 point) const {
      const Vector8 size = absolute(point);
      return at_most(size.x, inner.x) & at_most(size.y, inner.y) & at_most(size.z, inner.z);
    }

    Vector8 half, inner, outer;
    Floats8 across, plane;
    bool in_range;  // no product of shadows underflows
  };

  static constexpr float kEdgeScale = 0x1p60f;

  static inline Floats8 minus(Floats8 a) { return Floats8::splat(0) - a; }

  // Along the box's axes.
  inline Vector8 seen(Vector8 v) const {
    if constexpr (!kTurned) return v;
    const float* r = box_->rotation;
    const auto column = [&](int k) {
      return multiply_add(Floats8::splat(r[k]), v.x,
                          multiply_add(Floats8::splat(r[3 + k]), v.y, Floats8::splat(r[6 + k]) * v.z));
    };
    return {column(0), column(1), column(2)};
  }

  inline Vector8 edge_of(const TriangleBlock& block, int from, int to) const {
    return seen(Vector8::load(block.vertices + to) - Vector8::load(block.vertices + from));
  }

  // Boxes against the turned box, along its own axes; `low` and `high` are seen from its centre.
  inline MetChildren meet_turned(Vector8 low, Vector8 high) const {
    const Floats8 half = Floats8::splat(0.5f);
    const Vector8 middle = seen({(low.x + high.x) * half, (low.y + high.y) * half, (low.z + high.z) * half});
    const Vector8 extent = times(high - low, half);
    const Floats8 pad = Floats8::splat(unless(PlantedBug::kRegionTurnedNode, 0x1p-19f)) *
                        (maximum(absolute(low.x), absolute(high.x)) + maximum(absolute(low.y), absolute(high.y)) +
                         maximum(absolute(low.z), absolute(high.z)));
    uint32_t some = 255, whole = 255;
    const Floats8 middles[3] = {absolute(middle.x), absolute(middle.y), absolute(middle.z)};
    for (int k = 0; k < 3; ++k) {
      const float* r = box_->rotation + k;
      const Floats8 reach = multiply_add(
          absolute(Floats8::splat(r[0])), extent.x,
          multiply_add(absolute(Floats8::splat(r[3])), extent.y, absolute(Floats8::splat(r[6])) * extent.z));
      const Floats8 own = Floats8::splat(box_->half[k]);
      some &= at_most(middles[k] - reach, own + pad);
      whole &= at_most(middles[k] + reach, own - pad);
    }
    return {some, whole & some};
  }

  static inline void meet_normal(Vector8 normal, Vector8 vertex, const Span& span, Shadows& shadows) {
    const Floats8 height = absolute(dot(normal, vertex)), reach = dot(absolute(normal), span.half);
    shadows.meet(height, reach - span.plane, reach + span.plane);
  }

  // The axes across an edge from `from`; `other` is the vertex that the edge does not touch.
  static inline void meet_edge(Vector8 edge, Vector8 from, Vector8 other, const Span& span, Shadows& shadows) {
    const Vector8 e = times(edge, Floats8::splat(planted(PlantedBug::kRegionEdgeScale) ? 1 : kEdgeScale));
    meet_across(e.y, e.z, from.y, from.z, other.y, other.z, span.inner.y, span.inner.z, span.outer.y, span.outer.z,
                span.across, shadows);
    meet_across(e.z, e.x, from.z, from.x, other.z, other.x, span.inner.z, span.inner.x, span.outer.z, span.outer.x,
                span.across, shadows);
    meet_across(e.x, e.y, from.x, from.y, other.x, other.y, span.inner.x, span.inner.y, span.outer.x, span.outer.y,
                span.across, shadows);
  }

  // In the plane of two of the box's axes: the axis across the edge (x, y) is (-y, x).
  static inline void meet_across(Floats8 x, Floats8 y, Floats8 from_x, Floats8 from_y, Floats8 other_x, Floats8 other_y,
                                 Floats8 inner_x, Floats8 inner_y, Floats8 outer_x, Floats8 outer_y, Floats8 across,
                                 Shadows& shadows) {
    const Floats8 p = multiply_subtract(x, from_y, y * from_x), q = multiply_subtract(x, other_y, y * other_x);
    const Floats8 gap = maximum(minimum(p, q), minus(maximum(p, q)));
    const Floats8 size_x = absolute(x), size_y = absolute(y);
    shadows.meet(gap, multiply_add(size_y, inner_x, multiply_subtract(size_x, inner_y, across)),
                 multiply_add(size_y, outer_x, multiply_add(size_x, outer_y, across)));
  }

  Boxes8 outer_, inner_;
  Vector8 center_;
  const KernelBox* box_;
};

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BOX_IMPL_H_
