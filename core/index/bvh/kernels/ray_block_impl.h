// Test of one ray with the eight triangles of a block, or of eight rays with one triangle. A test in float excludes
// most triangles; a test in double gives the result for the triangles that remain. A sheared coordinate is x or y of a
// vertex, relative to the origin and projected along the ray to z = 0; TriangleRay computes the same value multiplied
// by d. Error bounds, with R = max |origin| + max |vertex|, E = the block's extent, and d = the direction's largest
// component:
//
// - The error of a sheared coordinate is at most 10 * 2^-24 R: rounding of the origin, the differences, the shear, the
//   product and the sum. A ray that hits the block's padded box passes within 2^-20 R of it, so sheared coordinates are
//   at most 2 E + 2^-18 R, and the error of an edge function (two products and a difference) is less than
//   edge = 2^-17 R E + 2^-36 R^2.
// - t is an average of vertex depths with the edge functions as weights. If |determinant| > 8 edge, the error of t is
//   at most (6 edge E / |determinant| + 2^-20 R) / |d|. A ray that starts on a triangle hits it although rounding may
//   place the triangle up to 2^-42 R^3 / |determinant / d| behind the start; the interval of t includes this distance.
//   Products that underflow add at most 2^-150 / |determinant|, which is within 2^-20 R / |d| if R >= 2^-25 and |d| <=
//   2^20.
// - If TriangleRay treats a triangle as nearly edge-on, double is not precise enough, and the verdict on the ray is
//   kUndecided. The error in double of a hit on any other triangle is less than 2^-24 of the coordinates of the hit and
//   the origin. The hit therefore lies within the padded slabs of the triangle's own box. TriangleRay clamps t to that
//   box, and queries clamp it to the bounds of the instance; neither clamp has an effect on such a hit.
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

// Eight pairs of a ray and a triangle: one ray with eight triangles, or eight rays with one triangle.
struct Pairs {
  Floats8 from_x, from_y, from_z;  // origin of the ray on the axes of the projection
  Floats8 shear_x, shear_y, reciprocal_z;
  Floats8 limit;
  // Error bounds: `edge` for the edge functions, noise / |determinant| + t_floor for t.
  Floats8 edge, noise, t_floor;
  Floats8 xs[3], ys[3], zs[3];  // coordinates of the triangle's vertices
};

// Triangles of eight pairs, projected along the ray, relative to the ray's origin. All coordinates are negated, which
// does not change the edge functions, because each is a sum of products of two coordinates.
struct Projected {
  Floats8 weight_a, weight_b, weight_c;  // edge functions
  Floats8 a_z, b_z, c_z;                 // depths, negated
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

// Results of the float test of eight pairs of a ray and a triangle. A mask has one bit for each pair.
struct PairResults {
  uint32_t candidates;             // mask of the pairs that may hit within the limit
  uint32_t inside;                 // mask of the pairs whose edge functions may all have the same sign
  uint32_t edge_on;                // mask of the pairs that may be edge-on, for which t is not known
  Floats8 min_weight, max_weight;  // smallest and largest edge function of each pair
  Floats8 earliest, latest;        // bounds of t
};

// Tests eight pairs in float.
static inline PairResults test_pairs(const Pairs& pairs) {
  const Projected p = project(pairs);
  const Floats8 zero = Floats8::splat(0);
  PairResults results;
  results.min_weight = minimum(p.weight_a, minimum(p.weight_b, p.weight_c));
  results.max_weight = maximum(p.weight_a, maximum(p.weight_b, p.weight_c));
  results.inside = at_most(zero - pairs.edge, results.min_weight) | at_most(results.max_weight, pairs.edge);
  const Floats8 determinant = p.weight_a + p.weight_b + p.weight_c;
  const Floats8 inverse = Floats8::splat(1) / determinant;
  const Floats8 negative_depth = multiply_add(p.weight_a, p.a_z, multiply_add(p.weight_b, p.b_z, p.weight_c * p.c_z));
  const Floats8 t = zero - negative_depth * pairs.reciprocal_z * inverse;
  const Floats8 t_error =
      planted(PlantedBug::kKernelTBound) ? zero : multiply_add(pairs.noise, absolute(inverse), pairs.t_floor);
  results.earliest = t - t_error;
  results.latest = t + t_error;
  results.edge_on = at_most(absolute(determinant), Floats8::splat(8) * pairs.edge);
  results.candidates =
      results.inside & (results.edge_on | (at_most(results.earliest, pairs.limit) & at_most(zero, results.latest)));
  if (planted(PlantedBug::kKernelEdgeOn)) results.candidates &= ~results.edge_on;
  return results;
}

// Returns the mask of the pairs that certainly hit within the limit. `front` and `back` are the masks of the pairs
// whose rays accept a triangle seen from the front or from the back.
static inline uint32_t certain_hits(const Pairs& pairs, const PairResults& results, uint32_t front, uint32_t back) {
  const Floats8 zero = Floats8::splat(0);
  return results.inside & ~results.edge_on & below(zero, results.earliest) & at_most(results.latest, pairs.limit) &
         ((front & below(pairs.edge, results.min_weight)) | (back & below(results.max_weight, zero - pairs.edge)));
}

// Results of the float test of one ray with a block; each mask has one bit per triangle.
struct BlockResults {
  uint32_t candidates;  // triangles that the ray may hit within the limit
  uint32_t certain;     // triangles that the ray certainly hits within the limit; 0 unless kAny
};

// Tests one ray with the triangles of a block in float. `query` is the caller's ray, from which `ray` was prepared.
template <bool kAny>
static inline BlockResults test_block(const TriangleBlock& block, PreparedRay ray, float limit,
                                      const KernelRay& query) {
  const float edge =
      planted(PlantedBug::kKernelEdgeBound) ? 0 : ray.value(kEdgeScale) * block.extent + ray.value(kEdgeFloor);
  Pairs pairs;
  pairs.from_x = ray.splat(kFromX);
  pairs.from_y = ray.splat(kFromY);
  pairs.from_z = ray.splat(kFromZ);
  pairs.shear_x = ray.splat(kShearX);
  pairs.shear_y = ray.splat(kShearY);
  pairs.reciprocal_z = ray.splat(kReciprocalZ);
  pairs.limit = Floats8::splat(limit);
  pairs.edge = Floats8::splat(edge);
  pairs.noise = Floats8::splat(edge * block.extent * ray.value(kEdgeNoise) + ray.value(kStartNoise));
  pairs.t_floor = ray.splat(kTFloor);
  const uint32_t x = ray.integer(kAxisX), y = ray.integer(kAxisY), z = ray.integer(kAxisZ);
  for (uint32_t vertex = 0; vertex < 3; ++vertex) {
    pairs.xs[vertex] = Floats8::load(block.vertices[x + 3 * vertex]);
    pairs.ys[vertex] = Floats8::load(block.vertices[y + 3 * vertex]);
    pairs.zs[vertex] = Floats8::load(block.vertices[z + 3 * vertex]);
  }
  BlockResults results;
  const PairResults triangles = test_pairs(pairs);
  const uint32_t lanes = (1u << block.count) - 1u;
  results.candidates = triangles.candidates & lanes;
  results.certain = 0;
  if constexpr (kAny)
    results.certain =
        certain_hits(pairs, triangles, query.accept_front ? ~0u : 0u, query.accept_back ? ~0u : 0u) & lanes;
  return results;
}

static inline Doubles splat(double value) { return Doubles{value, value, value, value}; }
// Returns the coordinate on mesh axis `axis` of the three vertices of the triangle in lane `lane`. The fourth element
// is unused.
static inline Doubles coordinates(const TriangleBlock& block, uint32_t axis, int lane) {
  const float(*const rows)[kTreeWidth] = block.vertices + axis;
  return widened(rows[0][lane], rows[3][lane], rows[6][lane]);
}

// Result of the test of one ray with one triangle in double. `t` is valid only for KernelVerdict::kHit.
struct Verdict {
  KernelVerdict verdict;
  float t;
};

// Constants of a ray for the test in double: columns of PreparedRays, which are loaded only when they are used.
struct PreparedConstants {
  PreparedRay ray;

  inline uint32_t axis_x() const { return ray.integer(kAxisX); }
  inline uint32_t axis_y() const { return ray.integer(kAxisY); }
  inline uint32_t axis_z() const { return ray.integer(kAxisZ); }
  inline float edge_scale() const { return ray.value(kEdgeScale); }
  inline float edge_floor() const { return ray.value(kEdgeFloor); }
  inline float start_noise() const { return ray.value(kStartNoise); }
  inline float t_floor() const { return ray.value(kTFloor); }
};

// Returns true if TriangleRay would treat the triangle as nearly edge-on; may also return true for triangles slightly
// beyond TriangleRay's bound. `size` is |determinant| and `along` is d; R, E and d are defined at the top of this file.
// Sheared coordinates are at most 2 E + 2^-18 R, so TriangleRay's bound is at most d^2 (2^-12 E^2 + 2^-29 R E + 2^-48
// R^2). This larger bound is cheaper to compute, so `size` is compared with it first.
template <class Constants>
static inline bool may_be_edge_on(const TriangleBlock& block, const Constants& constants, Doubles x, Doubles y,
                                  Doubles depths, double along, double size) {
  const double edge_scale = constants.edge_scale();
  const double extent = block.extent;
  if (size > 0x1p-12 * (extent * (extent + edge_scale) + constants.edge_floor()) * along * along) return false;
  const double reach = 0x1p17 * edge_scale, longest = __builtin_fabs(along);
  double width = 0x1p-39 * reach * longest;
  for (int vertex = 0; vertex < 3; ++vertex)
    width = maximum(width, maximum(__builtin_fabs(x[vertex]), __builtin_fabs(y[vertex])));
  const double span =
      maximum(depths[0], maximum(depths[1], depths[2])) - minimum(depths[0], minimum(depths[1], depths[2]));
  return size <= 4 * longest * width * (0x1p-16 * span + 0x1p-35 * reach);
}

// Returns the result of TriangleRay::is_exactly_edge_on(): whether the triangle's plane is perpendicular to a mesh axis
// and contains the ray's direction. Such triangles are frequent in meshes with axis-aligned walls.
static inline bool is_exactly_edge_on(const TriangleBlock& block, int lane, const KernelRay& ray) {
  uint32_t across = 0;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const float(*const rows)[kTreeWidth] = block.vertices + axis;
    across |= static_cast<uint32_t>(ray.direction[axis] == 0) & static_cast<uint32_t>(rows[0][lane] == rows[3][lane]) &
              static_cast<uint32_t>(rows[0][lane] == rows[6][lane]);
  }
  return ray.unrotated && across != 0;
}

// Tests in double whether the ray hits the triangle in lane `lane`. Computes TriangleRay::edge_test(), but omits its
// scaling by powers of two. For the directions and distances that the kernels accept, this scaling would change no bit
// of the result.
template <class Constants>
static inline Verdict decide(const TriangleBlock& block, int lane, const KernelRay& ray, const Constants& constants) {
  const uint32_t axis_x = constants.axis_x(), axis_y = constants.axis_y(), axis_z = constants.axis_z();
  const double along = ray.direction[axis_z];
  const Doubles z = coordinates(block, axis_z, lane) - splat(ray.origin[axis_z]);
  const Doubles x =
      (coordinates(block, axis_x, lane) - splat(ray.origin[axis_x])) * splat(along) - z * splat(ray.direction[axis_x]);
  const Doubles y =
      (coordinates(block, axis_y, lane) - splat(ray.origin[axis_y])) * splat(along) - z * splat(ray.direction[axis_y]);
  const Doubles weights = __builtin_shufflevector(x, x, 2, 0, 1, 3) * __builtin_shufflevector(y, y, 1, 2, 0, 3) -
                          __builtin_shufflevector(y, y, 2, 0, 1, 3) * __builtin_shufflevector(x, x, 1, 2, 0, 3);
  const double a = weights[0], b = weights[1], c = weights[2];
  const double determinant = a + b + c, size = __builtin_fabs(determinant);
  if (may_be_edge_on(block, constants, x, y, z, along, size))
    return {is_exactly_edge_on(block, lane, ray) ? KernelVerdict::kMiss : KernelVerdict::kUndecided, 0};
  if (minimum(a, minimum(b, c)) < 0 && maximum(a, maximum(b, c)) > 0) return {KernelVerdict::kMiss, 0};
  if (!(determinant > 0 || planted(PlantedBug::kKernelCull) ? ray.accept_front : ray.accept_back))
    return {KernelVerdict::kMiss, 0};
  const Doubles shares = weights * z;
  const double t = (shares[0] + shares[1] + shares[2]) / (determinant * along);
  if (t < 0) {
    const double unit = along * along;
    // A triangle far behind the origin is not hit. For a triangle slightly behind the origin the result depends on
    // TriangleRay::depth_error(), which is not computed here, so the verdict is kUndecided.
    const double noise = double{constants.start_noise()} * unit / size + double{constants.t_floor()};
    return {t < -noise ? KernelVerdict::kMiss : KernelVerdict::kUndecided, 0};
  }
  if ((t > 0 && t < 1e-30) || !(t < 1e30)) return {KernelVerdict::kUndecided, 0};
  return {KernelVerdict::kHit, static_cast<float>(t) + 0.0f};
}

// Results of decide_four(). A mask has one bit per pair; a pair in neither mask is a miss.
struct FourVerdicts {
  uint32_t hits;
  uint32_t unsure;  // pairs that decide() must decide
  float t[4];       // valid for hits
};

// Four pairs of a ray and a triangle. The rays start at the same point. The triangle of pair i is in lane lanes[i] of
// blocks[i]. Bit i of `front` and `back` is set if ray i accepts a triangle seen from the front or back.
struct FourPairs {
  const KernelRay* rays;
  const TriangleBlock* blocks[4];
  uint32_t lanes[4];
  uint32_t front, back;
};

// Tests four pairs in double, by the arithmetic of decide(). The rays share `constants`, of which start_noise and
// t_floor are not used. With kSame all pairs have the same triangle.
template <bool kSame, class Constants>
static inline FourVerdicts decide_four(const FourPairs& pairs, const Constants& constants) {
  const KernelRay* const rays = pairs.rays;
  const float* lanes[4];
  for (uint32_t i = 0; i < 4; ++i) lanes[i] = pairs.blocks[i]->vertices[0] + pairs.lanes[i];
  const auto coordinate = [&](uint32_t row) {
    const uint32_t at = row * kTreeWidth;
    if constexpr (kSame) return splat(double{lanes[0][at]});
    return widened(lanes[0][at], lanes[1][at], lanes[2][at], lanes[3][at]);
  };
  const auto direction = [&](uint32_t axis) {
    return Doubles{rays[0].direction[axis], rays[1].direction[axis], rays[2].direction[axis], rays[3].direction[axis]};
  };
  const uint32_t axis_x = constants.axis_x(), axis_y = constants.axis_y(), axis_z = constants.axis_z();
  const Doubles along = direction(axis_z), direction_x = direction(axis_x), direction_y = direction(axis_y);
  const Doubles from_x = splat(rays[0].origin[axis_x]), from_y = splat(rays[0].origin[axis_y]),
                from_z = splat(rays[0].origin[axis_z]);
  Doubles x[3], y[3], z[3];
  for (uint32_t vertex = 0; vertex < 3; ++vertex) {
    z[vertex] = coordinate(axis_z + 3 * vertex) - from_z;
    x[vertex] = (coordinate(axis_x + 3 * vertex) - from_x) * along - z[vertex] * direction_x;
    y[vertex] = (coordinate(axis_y + 3 * vertex) - from_y) * along - z[vertex] * direction_y;
  }
  const Doubles a = x[2] * y[1] - y[2] * x[1], b = x[0] * y[2] - y[0] * x[2], c = x[1] * y[0] - y[1] * x[0];
  const Doubles determinant = a + b + c, zero = splat(0);
  const Doubles t = (a * z[0] + b * z[1] + c * z[2]) / (determinant * along);
  const Doubles extent = kSame ? splat(pairs.blocks[0]->extent)
                               : widened(pairs.blocks[0]->extent, pairs.blocks[1]->extent, pairs.blocks[2]->extent,
                                         pairs.blocks[3]->extent);
  // The bound of may_be_edge_on(), which is the same for all four pairs.
  const Doubles bound = (extent * (extent + splat(constants.edge_scale())) + splat(constants.edge_floor())) *
                        splat(0x1p-12) * along * along;
  const auto not_edge_on = (determinant > bound) | (determinant < zero - bound);
  const auto miss = ((a < zero) | (b < zero) | (c < zero)) & ((a > zero) | (b > zero) | (c > zero));
  const auto ordinary = (t >= splat(1e-30)) & (t < splat(1e30));
  const auto mask = [](auto comparison) { return mask_bits(reinterpret_cast<DoubleMask>(comparison)); };
  const uint32_t is_front = planted(PlantedBug::kKernelCull) ? 15u : mask(determinant > zero);
  FourVerdicts verdicts;
  verdicts.hits = mask(not_edge_on & ordinary & ~miss) & ((is_front & pairs.front) | (~is_front & pairs.back));
  verdicts.unsure = ~mask(not_edge_on & (miss | ordinary)) & 15u;
  store_rounded(t, verdicts.t);
  return verdicts;
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_BLOCK_IMPL_H_
