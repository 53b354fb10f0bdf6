// Balls against boxes and triangles, eight at a time, for region_kernels_impl.h. The error bounds of the triangle
// tests, with u = 2^-24, E = the block's extent, r = the radius and L = r + 2 E: the ball reaches the block's box, so
// no vertex is farther from its centre than L, and no edge is longer than sqrt(3) E < L. The differences of floats, all
// that is computed from, are off by u of themselves. Every product and every sum is counted as a rounding of its own,
// as it is without fused ones: a product of two differences is off by 4 u of itself within a difference of two such
// products, and by 5 u within a dot product.
//
// Most triangles are told by their vertices alone, as seen from the centre:
// - A square of such a vertex is off by 5 u of itself: a vertex is inside up to r^2 (1 - 2^-19). The predicate finds it
//   by the edge that starts there, whatever the length of the edges.
// - The shadow of one vertex on another, A, is off by 5 u L |A|; 6 u more for both sides' squares. All three beyond
//   (r + 2^-19 (r + E)) |A| are out: a plane parts ball and triangle by more than 2^-22 L.
//
// The others are looked at closely:
// - A foot on an edge is off by 5 u L for the dot product, 5 u for the square of the edge and u for the quotient: 11 u
// L
//   along the edge. The way to it is off by 4 u L for the two differences, the product and the last difference, and its
//   length by 2 u: 17 u L in all, and near = 2^-19 L, with 2^-59 for squares that underflow, whose edges are shorter
//   than that.
// - A normal's component is off by 4 u of its two products and so by 8 u E^2, a normal by 14 u E^2; its dot product
// with
//   the offset by 14 u E^2 L and 4 u of at most 3 E^2 L: 26 u E^2 L. The radius times its length is off by 14 u E^2 L
//   and 4 u of 3 E^2 L: 26 u E^2 L, and 3 u for the sum: plane = 2^-17 E^2 L. That also keeps triangles with a sine
//   below 2^-20 at a vertex, for whose planes the predicate has a way of its own, from being found by their planes.
// - The foot's weights are differences of products of two dot products, off by 11 u of each product. Such a product is
//   at most 5.2 E^3 L, or 4.5 E^3 L for the square of the area: 125 u E^3 L for each of two weights, 100 u for the
//   square, and 60 u for the differences that leave the third weight: 410 u E^3 L. weight = 2^-15 E^3 L.
// - Of one triangle, with its longer edge at vertex a for E and the farther of that and the offset for R: weights are
// off
//   by 24 u E^3 R twice, 24 u for the square and 10 u, within 2^-17; normals by 6 u E^2, heights by 10 u E^2 R and the
//   radius times the length by 10 u E^2 r, within 2^-19 E^2 (R + r).
//
// The predicate's own roundings are smaller by 2^-28, or by 2^-12 in squared distances, so that what is certain here is
// its verdict. It also asks whether the ball reaches the triangle's own box: never farther than the triangle.
//
// Source: Ericson, Real-Time Collision Detection, 2005 (distances by clamped segments and weights of the foot).
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BALL_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BALL_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/region_kernels.h"

namespace locus {
namespace {

// Of the children of a node, those that are met and, of these, those that are wholly inside; bits by slot.
struct MetChildren {
  uint32_t some, whole;
};

// Of the triangles of a block, those that are found and those that only the judge can tell; bits by place.
struct MetTriangles {
  uint32_t sure, unsure;
};

constexpr float kSquarePad = 0x1p-19f;  // relative, of squared distances to boxes: their roundings come to 2^-21

// For squares, and products of more lengths, that underflow.
static inline float square_floor() { return planted(PlantedBug::kRegionFloor) ? 0 : 0x1p-120f; }

// A bound, or none.
static inline float unless(PlantedBug bug, float bound) { return planted(bug) ? 0 : bound; }

struct Vector8 {
  Floats8 x, y, z;

  static inline Vector8 splat(const float* three) {
    return {Floats8::splat(three[0]), Floats8::splat(three[1]), Floats8::splat(three[2])};
  }
  static inline Vector8 load(const float (*rows)[kTreeWidth]) {
    return {Floats8::load(rows[0]), Floats8::load(rows[1]), Floats8::load(rows[2])};
  }
  friend inline Vector8 operator-(Vector8 a, Vector8 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
};

static inline Floats8 dot(Vector8 a, Vector8 b) { return multiply_add(a.x, b.x, multiply_add(a.y, b.y, a.z * b.z)); }

static inline Vector8 cross(Vector8 a, Vector8 b) {
  return {multiply_subtract(a.y, b.z, a.z * b.y), multiply_subtract(a.z, b.x, a.x * b.z),
          multiply_subtract(a.x, b.y, a.y * b.x)};
}

// Squared distance from a point to a segment that starts at `offset` from it: the way from the segment's start to the
// point, along `edge`.
static inline Floats8 squared_distance_to_edge(Vector8 offset, Vector8 edge, Floats8 along, Floats8 length) {
  // A quotient of zeros becomes the second operand, zero.
  const Floats8 foot = minimum(maximum(along / length, Floats8::splat(0)), Floats8::splat(1));
  const Vector8 rest = {subtract_product(offset.x, foot, edge.x), subtract_product(offset.y, foot, edge.y),
                        subtract_product(offset.z, foot, edge.z)};
  return dot(rest, rest);
}

class BallQuery {
 public:
  inline void set(const KernelBall& ball) {
    center_ = Vector8::splat(ball.center);
    outer_ =
        Floats8::splat(ball.radius * ball.radius * (1 + unless(PlantedBug::kRegionReach, kSquarePad)) + square_floor());
    inner_ = Floats8::splat(ball.radius * ball.radius * (1 - unless(PlantedBug::kRegionInside, kSquarePad)) -
                            square_floor());
    radius_ = ball.radius;
  }

  __attribute__((always_inline)) inline MetChildren meet_node(const TriangleNode& node) const {
    const Vector8 below = Vector8::load(node.bounds) - center_, above = center_ - Vector8::load(node.bounds + 3);
    const Floats8 zero = Floats8::splat(0);
    const Vector8 gap = {maximum(maximum(below.x, above.x), zero), maximum(maximum(below.y, above.y), zero),
                         maximum(maximum(below.z, above.z), zero)};
    const Vector8 far = {minimum(below.x, above.x), minimum(below.y, above.y), minimum(below.z, above.z)};
    const uint32_t some = at_most(dot(gap, gap), outer_);
    return {some, at_most(dot(far, far), inner_) & some};
  }

  __attribute__((always_inline)) inline MetTriangles meet_block(const TriangleBlock& block) const {
    const Vector8 a = Vector8::load(block.vertices) - center_, b = Vector8::load(block.vertices + 3) - center_,
                  c = Vector8::load(block.vertices + 6) - center_;
    const Floats8 aa = dot(a, a), bb = dot(b, b), cc = dot(c, c), ab = dot(a, b), bc = dot(b, c), ca = dot(c, a);
    const uint32_t all = (1u << block.count) - 1u, in = at_most(minimum(aa, minimum(bb, cc)), inner_) & all;
    const float reach = radius_ + unless(PlantedBug::kRegionBeyond, 0x1p-19f) * (radius_ + block.extent);
    const Floats8 limit = Floats8::splat(reach * reach);
    const uint32_t out = lie_beyond(aa, ab, ca, limit) | lie_beyond(bb, bc, ab, limit) | lie_beyond(cc, ca, bc, limit);
    const uint32_t open = all & ~(in | out);
    if (open == 0) return {in, 0};
    const MetTriangles met = look_closely(block, open);
    return {in | met.sure, met.unsure};
  }

 private:
  // Whether three vertices lie beyond the plane across the first at the square root of `limit`: by its square, and the
  // products of the others with it.
  static inline uint32_t lie_beyond(Floats8 square, Floats8 second, Floats8 third, Floats8 limit) {
    const Floats8 least = maximum(minimum(square, minimum(second, third)), Floats8::splat(0));
    return below(multiply_add(square, limit, Floats8::splat(square_floor())), least * least);
  }

  // The triangles of a block whose bits are set. Not inline: it would take the registers of all the rest.
  __attribute__((noinline)) MetTriangles look_closely(const TriangleBlock& block, uint32_t asked) const {
    const Vector8 a = Vector8::load(block.vertices), b = Vector8::load(block.vertices + 3),
                  c = Vector8::load(block.vertices + 6);
    const Vector8 offset = center_ - a, ab = b - a, ac = c - a;
    const Vector8 normal = cross(ab, ac);
    const float reach = radius_ + 2 * block.extent, square = block.extent * block.extent;
    const Floats8 plane = Floats8::splat(
        unless(PlantedBug::kRegionPlane,
               0x1p-17f * square * reach + unless(PlantedBug::kRegionFloor, 0x1p-58f) * reach + square_floor()));
    const Floats8 height = absolute(dot(normal, offset));
    const Floats8 limit = Floats8::splat(radius_) * square_root(dot(normal, normal));
    const uint32_t open = at_most(height, limit + plane) & asked;  // the ball may reach the plane
    if (open == 0) return {0, 0};

    const Floats8 bb = dot(ab, ab), bc = dot(ab, ac), cc = dot(ac, ac), pb = dot(offset, ab), pc = dot(offset, ac);
    const Vector8 from_b = center_ - b, edge = c - b;
    const Floats8 to_edges =
        minimum(minimum(squared_distance_to_edge(offset, ab, pb, bb), squared_distance_to_edge(offset, ac, pc, cc)),
                squared_distance_to_edge(from_b, edge, dot(from_b, edge), dot(edge, edge)));
    const Floats8 weight_b = multiply_subtract(cc, pb, bc * pc), weight_c = multiply_subtract(bb, pc, bc * pb);
    const Floats8 weight_a = multiply_subtract(bb, cc, bc * bc) - weight_b - weight_c;
    const Floats8 least = minimum(weight_a, minimum(weight_b, weight_c));

    const float near = unless(PlantedBug::kRegionNear, 0x1p-19f * reach + unless(PlantedBug::kRegionFloor, 0x1p-59f));
    const float within = radius_ > near ? (radius_ - near) * (radius_ - near) * (1 - kSquarePad) : -1;
    const float beyond = (radius_ + near) * (radius_ + near) * (1 + kSquarePad);
    const float weight = unless(PlantedBug::kRegionWeight, 0x1p-15f * square * block.extent * reach + square_floor());
    const uint32_t sure = (at_most(to_edges, Floats8::splat(within)) |
                           (below(Floats8::splat(weight), least) & below(height, limit - plane))) &
                          open;
    const uint32_t far = below(Floats8::splat(beyond), to_edges);
    const MetTriangles met = {sure, open & ~sure & ~(far & below(least, Floats8::splat(-weight)))};
    if (met.unsure == 0) return met;

    // Most of these are small triangles in a block of large ones: the bounds of their own decide them.
    const Floats8 longest = maximum(bb, cc), reach8 = square_root(maximum(longest, dot(offset, offset)));
    const Floats8 own_weight = multiply_add(Floats8::splat(unless(PlantedBug::kRegionOwnBounds, 0x1p-17f)),
                                            longest * square_root(longest) * reach8, Floats8::splat(square_floor()));
    const Floats8 own_plane =
        multiply_add(multiply_add(Floats8::splat(unless(PlantedBug::kRegionOwnBounds, 0x1p-19f)), longest,
                                  Floats8::splat(unless(PlantedBug::kRegionFloor, 0x1p-58f))),
                     reach8 + Floats8::splat(radius_), Floats8::splat(square_floor()));
    const uint32_t in = below(own_weight, least) & below(height, limit - own_plane) & met.unsure;
    const uint32_t out = below(limit + own_plane, height) | (far & below(least, Floats8::splat(0) - own_weight));
    return {sure | in, met.unsure & ~in & ~out};
  }

  Vector8 center_;
  Floats8 outer_, inner_;  // squares of the radius
  float radius_;
};

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BALL_IMPL_H_
