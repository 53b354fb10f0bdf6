// Tests of a ball with eight boxes or eight triangles at a time, for region_kernels_impl.h. Error bounds of the
// triangle tests, with u = 2^-24, E = the block's extent, r = the radius and L = r + 2 E. The ball overlaps the block's
// box, so the distance of a vertex from the centre is at most L, and an edge is at most sqrt(3) E < L long. All
// computations start with differences of floats, whose relative error is u. Each product and each sum counts as one
// rounding, as if compiled without fused multiply-add: the error of a product of two differences is 4 u of its value
// within a difference of two such products, and 5 u within a dot product.
//
// For most triangles a test of the vertices alone, as vectors from the centre, determines the result:
// - The error of the squared length of such a vector is 5 u of its value: a vertex is certainly inside if its squared
//   length is at most r^2 (1 - 2^-19). The predicate then finds the triangle too, by its distance from the edge that
//   starts at this vertex; this is true for edges of any length.
// - The error of the dot product of such a vector with A, one of the three vectors, is 5 u L |A|; the squares on both
//   sides of the comparison add 6 u. If the dot products of all three vectors with A are greater than
//   (r + 2^-19 (r + E)) |A|, the triangle is outside: a plane separates it from the ball by more than 2^-22 L.
//
// The other triangles need the more expensive test of test_closely():
// - The error of the foot of the perpendicular on an edge is 5 u L for the dot product, 5 u for the square of the edge
//   and u for the quotient: 11 u L along the edge. The error of the vector from the foot to the centre is 4 u L for the
//   two differences, the product and the last difference, and the error of its length is 2 u L. The sum is 17 u L,
//   within near = 2^-19 L + 2^-59; the term 2^-59 covers edges so short that their squares underflow.
// - The error of a normal's component is 4 u of its two products, at most 8 u E^2, so the error of a normal is 14 u
//   E^2. The error of the dot product of the normal with the offset (the vector from vertex a to the centre) is 14 u
//   E^2 L and 4 u of at most 3 E^2 L: 26 u E^2 L. The error of the radius times the normal's length is 14 u E^2 L and 4
//   u of 3 E^2 L: 26 u E^2 L, and 3 u for the sum. The sum is within plane = 2^-17 E^2 L. This bound also prevents
//   triangles with a sine below 2^-20 at a vertex, whose planes the predicate handles separately, from being found by
//   their planes.
// - The barycentric weights of the foot on the plane are differences of products of two dot products; the error is 11 u
//   of each product. Such a product is at most 5.2 E^3 L, or 4.5 E^3 L for the square of the area: 125 u E^3 L for each
//   of two weights, 100 u for the square, and 60 u for the differences that leave the third weight. The sum is
//   410 u E^3 L, within weight = 2^-15 E^3 L.
// - In the error bounds of a single triangle, E is the length of its longer edge at vertex a, and R is the maximum of E
//   and the length of the offset. The errors of the weights, as in the list item before, are 24 u E^3 R for each of two
//   weights, 24 u E^3 R for the square and 10 u E^3 R for the differences: within 2^-17 E^3 R. The error of normals is
//   6 u E^2, the error of heights is 10 u E^2 R, and the error of the radius times the normal's length is 10 u E^2 r:
//   within 2^-19 E^2 (R + r).
//
// The predicate's own rounding errors are smaller by a factor of 2^-28, or 2^-12 for squared distances, so that a
// result that these tests call certain equals the result of the predicate. The predicate also tests whether the ball
// overlaps the triangle's own box, which is never farther away than the triangle.
//
// Source: Ericson, Real-Time Collision Detection, 2005 (distances by clamped segments and weights of the foot).
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BALL_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BALL_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/region_kernels.h"
#include "core/index/bvh/kernels/vector8.h"

namespace locus {
namespace {

// Result masks for the children of a node; one bit per slot.
struct ChildResults {
  uint32_t overlapping;  // boxes that the region may overlap
  uint32_t contained;    // overlapping boxes that are certainly inside the region
};

// Result masks for the triangles of a block; one bit per lane.
struct TriangleResults {
  uint32_t certain;    // triangles that certainly overlap the region
  uint32_t undecided;  // triangles that the RegionPredicate must test
};

constexpr float kSquarePad = 0x1p-19f;  // relative pad of squared distances to boxes; their rounding error is 2^-21

// Returns the absolute pad that covers the underflow of squares and of products of more than two lengths.
static inline float square_floor() { return planted(PlantedBug::kRegionFloor) ? 0 : 0x1p-120f; }

// Returns the error bound `bound`, or 0 if `bug` is planted. A test plants the bug to show that the bound is needed.
static inline float bound_unless(PlantedBug bug, float bound) { return planted(bug) ? 0 : bound; }

// Returns the squared distance from a point to an edge. `offset` is the vector from the start of the edge to the point,
// `edge` the vector along the edge, `along` their dot product and `length` the squared length of `edge`.
static inline Floats8 squared_distance_to_edge(Vector8 offset, Vector8 edge, Floats8 along, Floats8 length) {
  // If the edge has length 0, the quotient 0 / 0 is NaN, and maximum() returns its second operand, zero.
  const Floats8 foot = minimum(maximum(along / length, Floats8::splat(0)), Floats8::splat(1));
  const Vector8 rest = subtract_product(offset, foot, edge);
  return dot(rest, rest);
}

// Ball to be tested with the nodes and blocks of a tree: the template argument Query of region_kernels_impl.h.
class BallQuery {
 public:
  inline void set(const KernelBall& ball) {
    center_ = Vector8::splat(ball.center);
    outer_ = Floats8::splat(ball.radius * ball.radius * (1 + bound_unless(PlantedBug::kRegionReach, kSquarePad)) +
                            square_floor());
    inner_ = Floats8::splat(ball.radius * ball.radius * (1 - bound_unless(PlantedBug::kRegionInside, kSquarePad)) -
                            square_floor());
    radius_ = ball.radius;
  }

  // Tests the ball with the boxes of a node's children.
  __attribute__((always_inline)) inline ChildResults test_node(const TriangleNode& node) const {
    const Vector8 below = Vector8::load(node.bounds) - center_, above = center_ - Vector8::load(node.bounds + 3);
    const Floats8 zero = Floats8::splat(0);
    const Vector8 gap = {maximum(maximum(below.x, above.x), zero), maximum(maximum(below.y, above.y), zero),
                         maximum(maximum(below.z, above.z), zero)};
    const Vector8 far = {minimum(below.x, above.x), minimum(below.y, above.y), minimum(below.z, above.z)};
    const uint32_t overlapping = at_most(dot(gap, gap), outer_);
    return {overlapping, at_most(dot(far, far), inner_) & overlapping};
  }

  // Tests the ball with the triangles of a block.
  __attribute__((always_inline)) inline TriangleResults test_block(const TriangleBlock& block) const {
    const Vector8 a = Vector8::load(block.vertices) - center_, b = Vector8::load(block.vertices + 3) - center_,
                  c = Vector8::load(block.vertices + 6) - center_;
    const Floats8 aa = dot(a, a), bb = dot(b, b), cc = dot(c, c), ab = dot(a, b), bc = dot(b, c), ca = dot(c, a);
    const uint32_t lanes = (1u << block.count) - 1u, in = at_most(minimum(aa, minimum(bb, cc)), inner_) & lanes;
    const float plane_distance = radius_ + bound_unless(PlantedBug::kRegionBeyond, 0x1p-19f) * (radius_ + block.extent);
    const Floats8 limit = Floats8::splat(plane_distance * plane_distance);
    const uint32_t out =
        are_beyond_plane(aa, ab, ca, limit) | are_beyond_plane(bb, bc, ab, limit) | are_beyond_plane(cc, ca, bc, limit);
    const uint32_t open = lanes & ~(in | out);
    if (open == 0) return {in, 0};
    const TriangleResults results = test_closely(block, open);
    return {in | results.certain, results.undecided};
  }

 private:
  // Returns a mask with one bit per triangle, set if all its vertices lie beyond a plane at the distance sqrt(limit)
  // from the centre. The plane is perpendicular to the vector from the centre to the first vertex. `square` is the
  // squared length of this vector, and `second` and `third` are its dot products with the vectors to the other two
  // vertices.
  static inline uint32_t are_beyond_plane(Floats8 square, Floats8 second, Floats8 third, Floats8 limit) {
    const Floats8 min_product = maximum(minimum(square, minimum(second, third)), Floats8::splat(0));
    return below(multiply_add(square, limit, Floats8::splat(square_floor())), min_product * min_product);
  }

  // Tests the ball with those triangles of a block whose bits are set in `asked_lanes`. Not inline, because the caller
  // would then have to spill registers.
  __attribute__((noinline)) TriangleResults test_closely(const TriangleBlock& block, uint32_t asked_lanes) const {
    const Vector8 a = Vector8::load(block.vertices), b = Vector8::load(block.vertices + 3),
                  c = Vector8::load(block.vertices + 6);
    const Vector8 offset = center_ - a, ab = b - a, ac = c - a;
    const Vector8 normal = cross(ab, ac);
    const float reach = radius_ + 2 * block.extent, square = block.extent * block.extent;
    const Floats8 plane = Floats8::splat(bound_unless(
        PlantedBug::kRegionPlane,
        0x1p-17f * square * reach + bound_unless(PlantedBug::kRegionFloor, 0x1p-58f) * reach + square_floor()));
    const Floats8 height = absolute(dot(normal, offset));
    const Floats8 limit = Floats8::splat(radius_) * square_root(dot(normal, normal));
    const uint32_t open = at_most(height, limit + plane) & asked_lanes;  // the ball may overlap the plane
    if (open == 0) return {0, 0};

    const Floats8 bb = dot(ab, ab), bc = dot(ab, ac), cc = dot(ac, ac), pb = dot(offset, ab), pc = dot(offset, ac);
    const Vector8 from_b = center_ - b, edge = c - b;
    const Floats8 to_edges =
        minimum(minimum(squared_distance_to_edge(offset, ab, pb, bb), squared_distance_to_edge(offset, ac, pc, cc)),
                squared_distance_to_edge(from_b, edge, dot(from_b, edge), dot(edge, edge)));
    const Floats8 weight_b = multiply_subtract(cc, pb, bc * pc), weight_c = multiply_subtract(bb, pc, bc * pb);
    const Floats8 weight_a = multiply_subtract(bb, cc, bc * bc) - weight_b - weight_c;
    const Floats8 min_weight = minimum(weight_a, minimum(weight_b, weight_c));

    const float near =
        bound_unless(PlantedBug::kRegionNear, 0x1p-19f * reach + bound_unless(PlantedBug::kRegionFloor, 0x1p-59f));
    const float within = radius_ > near ? (radius_ - near) * (radius_ - near) * (1 - kSquarePad) : -1;
    const float beyond = (radius_ + near) * (radius_ + near) * (1 + kSquarePad);
    const float weight =
        bound_unless(PlantedBug::kRegionWeight, 0x1p-15f * square * block.extent * reach + square_floor());
    const uint32_t certain = (at_most(to_edges, Floats8::splat(within)) |
                              (below(Floats8::splat(weight), min_weight) & below(height, limit - plane))) &
                             open;
    const uint32_t far = below(Floats8::splat(beyond), to_edges);
    const TriangleResults results = {certain, open & ~certain & ~(far & below(min_weight, Floats8::splat(-weight)))};
    if (results.undecided == 0) return results;

    // Most triangles that are still undecided are small triangles in a block with large ones. Test these again with
    // error bounds that depend on the size of each triangle instead of the block's extent.
    const Floats8 longest = maximum(bb, cc), reach8 = square_root(maximum(longest, dot(offset, offset)));
    const Floats8 own_weight = multiply_add(Floats8::splat(bound_unless(PlantedBug::kRegionOwnBounds, 0x1p-17f)),
                                            longest * square_root(longest) * reach8, Floats8::splat(square_floor()));
    const Floats8 own_plane =
        multiply_add(multiply_add(Floats8::splat(bound_unless(PlantedBug::kRegionOwnBounds, 0x1p-19f)), longest,
                                  Floats8::splat(bound_unless(PlantedBug::kRegionFloor, 0x1p-58f))),
                     reach8 + Floats8::splat(radius_), Floats8::splat(square_floor()));
    const uint32_t in = below(own_weight, min_weight) & below(height, limit - own_plane) & results.undecided;
    const uint32_t out = below(limit + own_plane, height) | (far & below(min_weight, Floats8::splat(0) - own_weight));
    return {certain | in, results.undecided & ~in & ~out};
  }

  Vector8 center_;
  Floats8 outer_, inner_;  // squared radius, padded up and down
  float radius_;
};

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_REGION_BALL_IMPL_H_
