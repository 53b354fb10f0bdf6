// Balls against boxes and triangles, eight at a time, for region_kernels_impl.h. The error bounds of the triangle test,
// with u = 2^-24, E = the block's extent, r = the radius and L = r + 2 E: the ball reaches the block's box, so no
// vertex is farther from its centre than L, and no edge is longer than sqrt(3) E. The differences of floats, all that
// is computed from, are off by u of themselves.
//
// - A clamped foot on an edge is off by 14 u L along it, and a distance to it by 22 u L in all: near = 2^-19 L, with
//   2^-59 for squares that underflow, whose edges are shorter than that.
// - A normal is off by 18 u E^2; a height times the normal's length, and the radius times it, by 75 u E^2 L together:
//   plane = 2^-17 E^2 L. That also keeps triangles with a sine below 2^-20 at a vertex, for whose planes the predicate
//   has a way of its own, from being found by their planes.
// - The foot's weights, differences of products of four lengths, are off by 420 u E^3 L: weight = 2^-15 E^3 L.
//
// The predicate's own roundings are smaller by 2^-28, or by 2^-12 in squared distances, so that what is certain here is
// its verdict. It also asks whether the ball reaches the triangle's own box: never farther than the triangle.
//
// Source: Ericson, Real-Time Collision Detection, 2005 (distances by clamped segments and weights of the foot).
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BALL_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BALL_IMPL_H_

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

constexpr float kSquarePad = 0x1p-19f;     // relative, of squared distances to boxes: their roundings come to 2^-21
constexpr float kSquareFloor = 0x1p-120f;  // for squares that underflow

struct Vector8 {
  Floats8 x, y, z;

  static inline Vector8 all(const float* three) {
    return {Floats8::all(three[0]), Floats8::all(three[1]), Floats8::all(three[2])};
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
  const Floats8 foot = smaller(larger(along / length, Floats8::all(0)), Floats8::all(1));
  const Vector8 rest = {subtract_product(offset.x, foot, edge.x), subtract_product(offset.y, foot, edge.y),
                        subtract_product(offset.z, foot, edge.z)};
  return dot(rest, rest);
}

class BallQuery {
 public:
  inline void set(const KernelBall& ball) {
    center_ = Vector8::all(ball.center);
    outer_ = Floats8::all(ball.radius * ball.radius * (1 + kSquarePad) + kSquareFloor);
    inner_ = Floats8::all(ball.radius * ball.radius * (1 - kSquarePad) - kSquareFloor);
    radius_ = ball.radius;
  }

  __attribute__((always_inline)) inline MetChildren meet_node(const TriangleNode& node) const {
    const Vector8 below = Vector8::load(node.bounds) - center_, above = center_ - Vector8::load(node.bounds + 3);
    const Floats8 zero = Floats8::all(0);
    const Vector8 gap = {larger(larger(below.x, above.x), zero), larger(larger(below.y, above.y), zero),
                         larger(larger(below.z, above.z), zero)};
    const Vector8 far = {smaller(below.x, above.x), smaller(below.y, above.y), smaller(below.z, above.z)};
    const uint32_t some = at_most(dot(gap, gap), outer_);
    return {some, at_most(dot(far, far), inner_) & some};
  }

  __attribute__((always_inline)) inline MetTriangles meet_block(const TriangleBlock& block) const {
    const Vector8 a = Vector8::load(block.vertices), b = Vector8::load(block.vertices + 3),
                  c = Vector8::load(block.vertices + 6);
    const Vector8 offset = center_ - a, ab = b - a, ac = c - a;
    const Vector8 normal = cross(ab, ac);
    const float reach = radius_ + 2 * block.extent, square = block.extent * block.extent;
    const Floats8 plane = Floats8::all(0x1p-17f * square * reach + 0x1p-58f * reach + kSquareFloor);
    const Floats8 height = size_of(dot(normal, offset));
    const Floats8 limit = Floats8::all(radius_) * square_root(dot(normal, normal));
    const uint32_t all = (1u << block.count) - 1u;
    const uint32_t open = at_most(height, limit + plane) & all;  // the ball may reach the plane
    if (open == 0) return {0, 0};

    const Floats8 bb = dot(ab, ab), bc = dot(ab, ac), cc = dot(ac, ac), pb = dot(offset, ab), pc = dot(offset, ac);
    const Vector8 from_b = center_ - b, edge = c - b;
    const Floats8 to_edges =
        smaller(smaller(squared_distance_to_edge(offset, ab, pb, bb), squared_distance_to_edge(offset, ac, pc, cc)),
                squared_distance_to_edge(from_b, edge, dot(from_b, edge), dot(edge, edge)));
    const Floats8 weight_b = multiply_subtract(cc, pb, bc * pc), weight_c = multiply_subtract(bb, pc, bc * pb);
    const Floats8 weight_a = multiply_subtract(bb, cc, bc * bc) - weight_b - weight_c;
    const Floats8 least = smaller(weight_a, smaller(weight_b, weight_c));

    const float near = 0x1p-19f * reach + 0x1p-59f;
    const float within = radius_ > near ? (radius_ - near) * (radius_ - near) * (1 - kSquarePad) : -1;
    const float beyond = (radius_ + near) * (radius_ + near) * (1 + kSquarePad);
    const float weight = 0x1p-15f * square * block.extent * reach + kSquareFloor;
    const uint32_t sure = (at_most(to_edges, Floats8::all(within)) |
                           (below(Floats8::all(weight), least) & below(height, limit - plane))) &
                          open;
    const uint32_t far = below(Floats8::all(beyond), to_edges);
    const MetTriangles met = {sure, open & ~sure & ~(far & below(least, Floats8::all(-weight)))};
    if (met.unsure == 0) return met;

    // Most of these are small triangles in a block of large ones: the bounds of their own decide them.
    const Floats8 longest = larger(bb, cc), reach8 = square_root(larger(longest, dot(offset, offset)));
    const Floats8 own_weight =
        multiply_add(Floats8::all(0x1p-17f), longest * square_root(longest) * reach8, Floats8::all(kSquareFloor));
    const Floats8 own_plane = multiply_add(multiply_add(Floats8::all(0x1p-19f), longest, Floats8::all(0x1p-58f)),
                                           reach8 + Floats8::all(radius_), Floats8::all(kSquareFloor));
    const uint32_t in = below(own_weight, least) & below(height, limit - own_plane) & met.unsure;
    const uint32_t out = below(limit + own_plane, height) | (far & below(least, Floats8::all(0) - own_weight));
    return {sure | in, met.unsure & ~in & ~out};
  }

 private:
  Vector8 center_;
  Floats8 outer_, inner_;  // squares of the radius
  float radius_;
};

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BALL_IMPL_H_
