// Bounds of the distances from a point to the eight triangles of a block, for nearest_kernels_impl.h.
//
// For each triangle, the kernel first computes the barycentric weights of a point q of the triangle: the best of the
// nearest points on the three edges and, if it lies within the triangle, the nearest point on the plane. Rounding may
// lead to another q, but the bounds hold for every point q of the triangle. Let r be the vector from q to the query's
// point p:
// - q is a point of the triangle, so the distance is at most |r|;
// - for every vertex v, (p - v).r / |r| is the distance of v behind the plane through p that is perpendicular to r; the
//   whole triangle is at least as far behind this plane as its nearest vertex, so the distance is at least the least of
//   these three values.
// Both bounds are equal if q is the nearest point. If it is not, which is possible for very thin triangles, the bounds
// are only farther apart, and the measurement in double decides.
//
// Error bounds, with u = 2^-24 and L = d + 2 E, where d is the distance of the block's box and E the block's extent.
// The distance of a vertex from p is at most L, and an edge is at most sqrt(3) E < L long. Each product and each sum
// counts as one rounding, as if compiled without fused multiply-add.
// - The weights are between 0 and 1, and their sum is at most 1 + 2 u: q is off the triangle by at most 2 u L. The
//   errors of r = (p - a) - s (b - a) - t (c - a) are u L, 2 u L and 2 u L for the terms, and at most 2 u L and 3 u L
//   for the two differences: 10 u L. The error of |r| is 3 u |r|, and |r| is at most 2 L. So the upper bound is too low
//   by at most 18 u L.
// - The dot products of r with p - a and with an edge have errors of 4 u |r| L each, their difference 2 u |r| L more:
//   10 u |r| L. The quotient by |r| adds 4 u L. So the lower bound is too high by at most 14 u L.
// Both errors are within 2^-19 L = 32 u L. The additional term 2^-59 of the error bound covers the case that |r| is
// below 2^-60, so that its square underflows: |r| is then raised to 2^-60, which lowers a positive quotient.
//
// Source: Ericson, Real-Time Collision Detection, 2005, 5.1.5 (nearest point of a triangle by regions); the lower bound
// is that of a separating plane.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_BLOCK_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_BLOCK_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/nearest_kernels.h"
#include "core/index/bvh/kernels/vector8.h"

namespace locus {
namespace {

// One point of each of eight triangles: `s` and `t` are the barycentric weights of the second and third vertex; `gain`
// is the squared distance of this point from the query's point, minus the squared distance of the first vertex.
struct Weights8 {
  Floats8 s, t, gain;
};

static inline Weights8 better_of(const Weights8& a, const Weights8& b) {
  const Floats8 mask = greater_equal_mask(a.gain, b.gain);
  return {select(mask, b.s, a.s), select(mask, b.t, a.t), select(mask, b.gain, a.gain)};
}

// Returns `a` clamped to 0 .. 1; 0 for a NaN.
static inline Floats8 clamped(Floats8 a) { return minimum(maximum(a, Floats8::splat(0)), Floats8::splat(1)); }

// Returns the weights of the nearest point of each triangle. Because of rounding, the point may not be the nearest one,
// but it is always a point of the triangle. `ap`, `ab` and `ac` are the vectors from the first vertex to the query's
// point and to the other two vertices.
__attribute__((always_inline)) inline Weights8 nearest_weights(Vector8 ap, Vector8 ab, Vector8 ac) {
  const Floats8 zero = Floats8::splat(0), one = Floats8::splat(1);
  const Floats8 bb = dot(ab, ab), bc = dot(ab, ac), cc = dot(ac, ac), pb = dot(ab, ap), pc = dot(ac, ap);
  const Floats8 pb2 = pb + pb, pc2 = pc + pc;
  // The two edges from the first vertex: the squared distance of the point at s exceeds that of the vertex by s (s bb -
  // 2 pb).
  const Floats8 s = clamped(pb / bb), t = clamped(pc / cc);
  Weights8 best = better_of({s, zero, s * multiply_subtract(s, bb, pb2)}, {zero, t, t * multiply_subtract(t, cc, pc2)});
  // The edge from the second to the third vertex.
  const Floats8 square = (bb - bc) + (cc - bc), along = (pc - pb) + (bb - bc);
  const Floats8 w = clamped(along / square);
  best = better_of(best, {one - w, w, multiply_add(w, multiply_subtract(w, square, along + along), bb - pb2)});
  // The plane of the triangle, if the point is within the triangle.
  const Floats8 inverse = one / multiply_subtract(bb, cc, bc * bc);
  const Floats8 u = multiply_subtract(cc, pb, bc * pc) * inverse, v = multiply_subtract(bb, pc, bc * pb) * inverse;
  const Floats8 u_gain = u * (multiply_subtract(u, bb, pb2) + bc * (v + v));
  const Floats8 gain = multiply_add(v, multiply_subtract(v, cc, pc2), u_gain);
  const Floats8 within = greater_equal_mask(minimum(minimum(one - (u + v), u), v), zero);
  return better_of(best, {u, v, select(within, gain, Floats8::splat(0x1p126f))});
}

// Bounds of the distances of eight triangles from a point, not yet widened by the error bound.
struct Bounds8 {
  Floats8 low, high;
};

__attribute__((always_inline)) inline Bounds8 distance_bounds(Vector8 point, const TriangleBlock& block) {
  const Vector8 a = Vector8::load(block.vertices);
  const Vector8 ap = point - a, ab = Vector8::load(block.vertices + 3) - a, ac = Vector8::load(block.vertices + 6) - a;
  const Weights8 nearest = nearest_weights(ap, ab, ac);
  const Vector8 rest = subtract_product(subtract_product(ap, nearest.s, ab), nearest.t, ac);
  const Floats8 high =
      maximum(square_root(dot(rest, rest)), Floats8::splat(planted(PlantedBug::kNearestFloor) ? 0 : 0x1p-60f));
  const Floats8 highest = maximum(maximum(dot(rest, ab), dot(rest, ac)), Floats8::splat(0));
  return {(dot(rest, ap) - highest) / high, high};
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_BLOCK_IMPL_H_
