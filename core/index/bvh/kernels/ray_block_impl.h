// One ray against the eight triangles of a block: which of them float cannot rule out, and what double says of those.
// The error bounds, with R = max |origin| + max |vertex|, E = the block's extent, and lengths along the shear divided
// by the direction's largest component d:
//
// - A sheared coordinate is off by at most 10 * 2^-24 R: rounding the origin, the differences, the shear, the product,
//   the sum. A ray that meets the block's box passes within 2^-20 R of it, so sheared coordinates are at most
//   2 E + 2^-18 R, and an edge function, two products and a difference, is off by less than
//   edge = 2^-17 R E + 2^-36 R^2.
// - t is an average of vertex depths with the edge functions as weights. It is off by at most
//   (6 edge E / |determinant| + 2^-20 R) / |d| where |determinant| > 8 edge. A ray that starts on a triangle hits it
//   although rounding puts it behind by up to 2^-42 R^3 / |determinant / d|, which the interval of t includes.
//   Products that underflow add at most 2^-150 / |determinant|, within the 2^-20 R / |d| for R from 2^-25 and |d| to
//   2^20.
// - What TriangleRay calls nearly edge-on, where double is too coarse, is left to it. Any other hit is moved by double
//   by less than 2^-24 of its own coordinates and the origin's, so that it lies in the padded slabs of its own box and
//   TriangleRay's and the placed bounds' clamps leave t as it is.
//
// Source: Woop, Benthin, Wald, Watertight Ray/Triangle Intersection, 2013.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_BLOCK_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_BLOCK_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/ray_kernels.h"
#include "core/index/bvh/kernels/ray_setup_impl.h"

namespace locus {
namespace {

static inline double maximum(double a, double b) { return a < b ? b : a; }
static inline double minimum(double a, double b) { return b < a ? b : a; }

// One ray with eight triangles, or eight rays with one: in either case eight pairs side by side.
struct Pairs {
  Floats8 from_x, from_y, from_z;  // where the ray starts
  Floats8 shear_x, shear_y, reciprocal_z;
  Floats8 limit;
  Floats8 edge, noise, t_floor;  // bounds: of the edge functions; of t times the determinant; of t besides
  Floats8 xs[3], ys[3], zs[3];   // of the triangle's vertices
};

// A pair in the projection along the ray, from the ray's start: every coordinate with its sign turned, which changes no
// edge function.
struct Projected {
  Floats8 weight_a, weight_b, weight_c;  // edge functions
  Floats8 a_z, b_z, c_z;                 // depths
};

static inline Projected project(const Pairs& pairs) {
  Projected p;
  p.a_z = pairs.from_z - pairs.zs[0];
  p.b_z = pairs.from_z - pairs.zs[1];
  p.c_z = pairs.from_z - pairs.zs[2];
  const Floats8 a_x = subtract_product(pairs.from_x - pairs.xs[0], pairs.shear_x, p.a_z);
  const Floats8 a_y = subtract_product(pairs.from_y - pairs.ys[0], pairs.shear_y, p.a_z);
  const Floats8 b_x = subtract_product(pairs.from_x - pairs.xs[1], pairs.shear_x, p.b_z);
  const Floats8 b_y = subtract_product(pairs.from_y - pairs.ys[1], pairs.shear_y, p.b_z);
  const Floats8 c_x = subtract_product(pairs.from_x - pairs.xs[2], pairs.shear_x, p.c_z);
  const Floats8 c_y = subtract_product(pairs.from_y - pairs.ys[2], pairs.shear_y, p.c_z);
  p.weight_a = multiply_subtract(c_x, b_y, c_y * b_x);
  p.weight_b = multiply_subtract(a_x, c_y, a_y * c_x);
  p.weight_c = multiply_subtract(b_x, a_y, b_y * a_x);
  return p;
}

// What float can tell of a triangle and a ray.
struct PairsMet {
  uint32_t open;  // may hit within the limit; one bit a pair
  uint32_t inside, edge_on;
  Floats8 least, most;       // of the edge functions
  Floats8 earliest, latest;  // t is between them
};

static inline PairsMet meet(const Pairs& pairs) {
  const Projected p = project(pairs);
  const Floats8 zero = Floats8::all(0);
  PairsMet met;
  met.least = minimum(p.weight_a, minimum(p.weight_b, p.weight_c));
  met.most = maximum(p.weight_a, maximum(p.weight_b, p.weight_c));
  met.inside = at_most(zero - pairs.edge, met.least) | at_most(met.most, pairs.edge);
  const Floats8 determinant = p.weight_a + p.weight_b + p.weight_c;
  const Floats8 inverse = Floats8::all(1) / determinant;
  const Floats8 behind = multiply_add(p.weight_a, p.a_z, multiply_add(p.weight_b, p.b_z, p.weight_c * p.c_z));
  const Floats8 t = zero - behind * pairs.reciprocal_z * inverse;
  const Floats8 off =
      planted(PlantedBug::kKernelTBound) ? zero : multiply_add(pairs.noise, absolute(inverse), pairs.t_floor);
  met.earliest = t - off;
  met.latest = t + off;
  met.edge_on = at_most(absolute(determinant), Floats8::all(8) * pairs.edge);
  met.open = met.inside & (met.edge_on | (at_most(met.earliest, pairs.limit) & at_most(zero, met.latest)));
  if (planted(PlantedBug::kKernelEdgeOn)) met.open &= ~met.edge_on;
  return met;
}

// The pairs that hit within the limit for certain. `front` and `back`: those whose rays accept a triangle seen so.
static inline uint32_t sure(const Pairs& pairs, const PairsMet& met, uint32_t front, uint32_t back) {
  const Floats8 zero = Floats8::all(0);
  return met.inside & ~met.edge_on & below(zero, met.earliest) & at_most(met.latest, pairs.limit) &
         ((front & below(pairs.edge, met.least)) | (back & below(met.most, zero - pairs.edge)));
}

// One ray and a block's triangles: a bit for each.
struct BlockMet {
  uint32_t open;  // may be hit within the limit
  uint32_t sure;  // are hit within the limit; kAny only
};

// One ray with a block's triangles.
template <bool kAny>
static inline BlockMet meet_block(const TriangleBlock& block, PreparedRay ray, float limit, const KernelRay& given) {
  const float edge =
      planted(PlantedBug::kKernelEdgeBound) ? 0 : ray.number(kEdgeScale) * block.extent + ray.number(kEdgeFloor);
  Pairs pairs;
  pairs.from_x = ray.spread(kFromX);
  pairs.from_y = ray.spread(kFromY);
  pairs.from_z = ray.spread(kFromZ);
  pairs.shear_x = ray.spread(kShearX);
  pairs.shear_y = ray.spread(kShearY);
  pairs.reciprocal_z = ray.spread(kReciprocalZ);
  pairs.limit = Floats8::all(limit);
  pairs.edge = Floats8::all(edge);
  pairs.noise = Floats8::all(edge * block.extent * ray.number(kEdgeNoise) + ray.number(kStartNoise));
  pairs.t_floor = ray.spread(kTFloor);
  const uint32_t x = ray.whole(kAxisX), y = ray.whole(kAxisY), z = ray.whole(kAxisZ);
  for (uint32_t vertex = 0; vertex < 3; ++vertex) {
    pairs.xs[vertex] = Floats8::load(block.vertices[x + 3 * vertex]);
    pairs.ys[vertex] = Floats8::load(block.vertices[y + 3 * vertex]);
    pairs.zs[vertex] = Floats8::load(block.vertices[z + 3 * vertex]);
  }
  BlockMet met;
  const PairsMet triangles = meet(pairs);
  const uint32_t places = (1u << block.count) - 1u;
  met.open = triangles.open & places;
  met.sure = 0;
  if constexpr (kAny)
    met.sure = sure(pairs, triangles, given.accept_front ? ~0u : 0u, given.accept_back ? ~0u : 0u) & places;
  return met;
}

static inline Doubles spread(double value) { return Doubles{value, value, value, value}; }
// Of the three vertices; the fourth is not used.
static inline Doubles coordinates(const TriangleBlock& block, uint32_t axis, int place) {
  const float(*const rows)[kTreeWidth] = block.vertices + axis;
  return widened(rows[0][place], rows[3][place], rows[6][place]);
}

struct Verdict {
  KernelVerdict what;
  float t;
};

// Whether TriangleRay may call the triangle nearly edge-on: its bound, or more. With sheared coordinates of up to
// 2 E + 2^-18 R (as above) that is at most d^2 (2^-12 E^2 + 2^-29 R E + 2^-48 R^2), which costs less to know.
static inline bool may_be_edge_on(const TriangleBlock& block, PreparedRay prepared, Doubles x, Doubles y,
                                  Doubles depths, double along, double size) {
  const double extent = block.extent, edge_scale = prepared.number(kEdgeScale);
  const double most = extent * (extent + edge_scale) + prepared.number(kEdgeFloor);
  if (size > 0x1p-12 * most * along * along) return false;
  const double reach = 0x1p17 * edge_scale, longest = __builtin_fabs(along);
  double width = 0x1p-39 * reach * longest;
  for (int vertex = 0; vertex < 3; ++vertex)
    width = maximum(width, maximum(__builtin_fabs(x[vertex]), __builtin_fabs(y[vertex])));
  const double span =
      maximum(depths[0], maximum(depths[1], depths[2])) - minimum(depths[0], minimum(depths[1], depths[2]));
  return size <= 4 * longest * width * (0x1p-16 * span + 0x1p-35 * reach);
}

// TriangleRay::is_exactly_edge_on(): walls seen from within their plane, often asked for where everything stands on a
// grid.
static inline bool is_exactly_edge_on(const TriangleBlock& block, int place, const KernelRay& ray) {
  uint32_t across = 0;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const float(*const rows)[kTreeWidth] = block.vertices + axis;
    across |= static_cast<uint32_t>(ray.direction[axis] == 0) &
              static_cast<uint32_t>(rows[0][place] == rows[3][place]) &
              static_cast<uint32_t>(rows[0][place] == rows[6][place]);
  }
  return ray.unturned && across != 0;
}

// One triangle in double: TriangleRay::edge_test() without its scaling, which changes no bit within the directions and
// distances accepted here.
static inline Verdict decide(const TriangleBlock& block, int place, const KernelRay& ray, PreparedRay prepared) {
  typedef int64_t Places __attribute__((vector_size(32)));
  const uint32_t axis_x = prepared.whole(kAxisX), axis_y = prepared.whole(kAxisY), axis_z = prepared.whole(kAxisZ);
  const double along = ray.direction[axis_z];
  const Doubles z = coordinates(block, axis_z, place) - spread(ray.origin[axis_z]);
  const Doubles x = (coordinates(block, axis_x, place) - spread(ray.origin[axis_x])) * spread(along) -
                    z * spread(ray.direction[axis_x]);
  const Doubles y = (coordinates(block, axis_y, place) - spread(ray.origin[axis_y])) * spread(along) -
                    z * spread(ray.direction[axis_y]);
  const Places before = {2, 0, 1, 3}, after = {1, 2, 0, 3};
  const Doubles weights = __builtin_shuffle(x, before) * __builtin_shuffle(y, after) -
                          __builtin_shuffle(y, before) * __builtin_shuffle(x, after);
  const double a = weights[0], b = weights[1], c = weights[2];
  const double determinant = a + b + c, size = __builtin_fabs(determinant);
  if (may_be_edge_on(block, prepared, x, y, z, along, size))
    return {is_exactly_edge_on(block, place, ray) ? KernelVerdict::kMiss : KernelVerdict::kUndecided, 0};
  if (minimum(a, minimum(b, c)) < 0 && maximum(a, maximum(b, c)) > 0) return {KernelVerdict::kMiss, 0};
  if (!(determinant > 0 || planted(PlantedBug::kKernelCull) ? ray.accept_front : ray.accept_back))
    return {KernelVerdict::kMiss, 0};
  const Doubles shares = weights * z;
  const double t = (shares[0] + shares[1] + shares[2]) / (determinant * along);
  if (t < 0) {
    const double unit = along * along;
    // Just behind the start is for TriangleRay::depth_noise() to judge; what is far behind, is not hit.
    const double noise = double{prepared.number(kStartNoise)} * unit / size + double{prepared.number(kTFloor)};
    return {t < -noise ? KernelVerdict::kMiss : KernelVerdict::kUndecided, 0};
  }
  if ((t > 0 && t < 1e-30) || !(t < 1e30)) return {KernelVerdict::kUndecided, 0};
  return {KernelVerdict::kHit, static_cast<float>(t) + 0.0f};
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_BLOCK_IMPL_H_
