// Beam of sixteen coherent rays that start at the same point, traced through one tree together. Rays of a camera
// or of a turning sensor form beams. Nodes are tested only with a frustum around the rays, eight boxes at a time. In a
// block, one test excludes the triangles that the frustum misses; each other triangle is tested with all rays together.
// The float tests only exclude: every reported hit is decided in double by the arithmetic of decide(), so the answer to
// a ray is the same as if the ray were traced alone.
//
// Coordinates are projected as in ray_block_impl.h, but along one ray in the middle of the beam. A ray of the beam is
// given by the differences u and v of its shears from the shears of this middle ray. From a common origin an edge
// function is exactly linear in u and v: with sheared coordinates x, y and depths z of the vertices b and c,
//
//   weight = (cx by - cy bx) + u (cy bz - cz by) + v (cz bx - cx bz)
//
// Error bound of this weight, with R as in ray_block_impl.h, e = 2^-24, s = the largest |u| or |v|, at most
// kMaxHalfSpread, and M = the largest |sheared coordinate| of the triangle: the error of a coordinate on the middle ray
// is at most 7 e R, that of u times a depth at most 5 e R, so that of a coordinate on the ray of u and v is at most
// 12 e R, where the coordinate itself is at most M + s R. Two products of an edge function differ from their exact
// values by at most 48 e R (M + s R); rounding of the three terms and of their sums adds at most 12 e R M (1 + s).
// Squares of errors are less than 2^-38 R^2. The sum is less than edge = 2^-18 R (M + s R) + 2^-36 R^2. t is an average
// of depths as before, so its error has the same bound as in ray_block_impl.h.
//
// Sources: Reshetov, Soupikov, Hurley, Multi-Level Ray Tracing Algorithm, 2005; Benthin, Wald, Efficient Ray Traced
// Soft Shadows using Multi-Frusta Tracing, 2009.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_BEAM_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_BEAM_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/floats16.h"
#include "core/index/bvh/kernels/ray_answer_impl.h"
#include "core/index/bvh/kernels/ray_block_impl.h"
#include "core/index/bvh/kernels/ray_setup_impl.h"

namespace locus {
namespace {

// Constants of a ray of a beam for the test in double, with the meaning of PreparedConstants.
struct BeamConstants {
  uint32_t axes[3];
  float scale, floor, noise, least_t;

  inline uint32_t axis_x() const { return axes[0]; }
  inline uint32_t axis_y() const { return axes[1]; }
  inline uint32_t axis_z() const { return axes[2]; }
  inline float edge_scale() const { return scale; }
  inline float edge_floor() const { return floor; }
  inline float start_noise() const { return noise; }
  inline float t_floor() const { return least_t; }
};

constexpr uint32_t kBeamRays = 16;
constexpr uint32_t kAllBeamRays = (1u << kBeamRays) - 1u;
constexpr uint32_t kMaxBeams = 16;  // maximum number of beams traced interleaved

// Returns the larger of two numbers. std::max() would be a function with external linkage, fmax() a call.
static inline float larger(float a, float b) { return a < b ? b : a; }

class Beam {
 public:
  uint32_t now;  // current node or block, or kNoChild at the end

  // Prepares kBeamRays rays and makes the root the current node. Returns false if the rays do not form a beam. Borrows
  // the tree and the rays.
  inline bool aim(const TriangleTree& tree, const KernelRay* rays) {
    if (!same_origins(rays)) return false;
    tree_ = &tree;
    rays_ = rays;
    Floats16 direction[3];
    load_directions(direction);
    if (!choose_axes(direction) || !set_shears(direction)) return false;
    set_frustum();
    load_limits();
    return true;
  }

  // Opens the current node: pushes the children whose boxes the frustum hits, with the least depths at which it enters
  // them, the nearest one last.
  inline void open_node() {
    const TriangleNode& node = tree_->nodes[now];
    const float* const bounds = node.bounds[0];
    Floats8 near[3], far[3];
    for (uint32_t k = 0; k < 3; ++k) {
      const Floats8 origin = Floats8::splat(origin_[k]), steep = Floats8::splat(steep_[k]),
                    flat = Floats8::splat(flat_[k]), pad = Floats8::splat(pads_[k]);
      const Floats8 entry = Floats8::load(bounds + kRows.entered[octant_][k]) - origin;
      const Floats8 exit = Floats8::load(bounds + kRows.left[octant_][k]) - origin;
      near[k] = minimum(entry * steep, entry * flat) - pad;
      far[k] = maximum(exit * steep, exit * flat) + pad;
    }
    const Floats8 entered = maximum(maximum(near[0], near[1]), maximum(near[2], Floats8::splat(0)));
    const Floats8 left = minimum(minimum(far[0], far[1]), minimum(far[2], Floats8::splat(limit_)));
    top_ += pack_sorted(node, entered, left, octant_, waiting_ + top_, nears_ + top_);
    ++nodes_;
  }

  // Pops the next node or block that a ray may enter within its limit, and prefetches it.
  inline void pop_next() {
    do --top_;
    while (nears_[top_] > limit_);
    now = waiting_[top_];
    if ((now & kBlockBit) == 0)
      prefetch(&tree_->nodes[now], sizeof(TriangleNode));
    else if (now != kNoChild)
      prefetch(&tree_->blocks[now & ~kBlockBit], sizeof(TriangleBlock));
  }

  // Projects the triangles of the current block along the middle ray. Returns the mask of the triangles that some ray
  // may hit.
  inline uint32_t project_block() {
    const TriangleBlock& block = tree_->blocks[now & ~kBlockBit];
    const uint32_t x = exact_.axes[0], y = exact_.axes[1], z = exact_.axes[2];
    const Floats8 from_x = Floats8::splat(origin_[x]), from_y = Floats8::splat(origin_[y]),
                  from_z = Floats8::splat(origin_[z]);
    const Floats8 shear_x = Floats8::splat(shear_x_), shear_y = Floats8::splat(shear_y_);
    Floats8 xs[3], ys[3], zs[3], largest = Floats8::splat(0);
    for (uint32_t vertex = 0; vertex < 3; ++vertex) {
      zs[vertex] = from_z - Floats8::load(block.vertices[z + 3 * vertex]);
      xs[vertex] = subtract_product(from_x - Floats8::load(block.vertices[x + 3 * vertex]), shear_x, zs[vertex]);
      ys[vertex] = subtract_product(from_y - Floats8::load(block.vertices[y + 3 * vertex]), shear_y, zs[vertex]);
      largest = maximum(largest, maximum(absolute(xs[vertex]), absolute(ys[vertex])));
    }
    const Floats8 spread = Floats8::splat(larger(spread_u_, spread_v_) * reach_);
    Floats8 edge = multiply_add(Floats8::splat(0.5f * exact_.scale), largest + spread, Floats8::splat(exact_.floor));
    if (planted(PlantedBug::kKernelEdgeBound)) edge = Floats8::splat(0);
    const Floats8 half_u = Floats8::splat(spread_u_), half_v = Floats8::splat(spread_v_);
    Floats8 greatest_low = Floats8::splat(-__builtin_inff()), least_high = Floats8::splat(__builtin_inff());
    for (uint32_t vertex = 0; vertex < 3; ++vertex) {
      const uint32_t b = (vertex + 1) % 3, c = (vertex + 2) % 3;
      const Floats8 constant = multiply_subtract(xs[c], ys[b], ys[c] * xs[b]);
      const Floats8 by_u = multiply_subtract(ys[c], zs[b], zs[c] * ys[b]);
      const Floats8 by_v = multiply_subtract(zs[c], xs[b], xs[c] * zs[b]);
      constant.store(rows_[3 * vertex]);
      by_u.store(rows_[3 * vertex + 1]);
      by_v.store(rows_[3 * vertex + 2]);
      const Floats8 half = multiply_add(absolute(by_u), half_u, absolute(by_v) * half_v);
      greatest_low = maximum(greatest_low, constant - half);
      least_high = minimum(least_high, constant + half);
    }
    const Floats8 to_depth = Floats8::splat(-sign_);
    (zs[0] * to_depth).store(rows_[kDepthA]);
    ((zs[1] - zs[0]) * to_depth).store(rows_[kDepthB]);
    ((zs[2] - zs[0]) * to_depth).store(rows_[kDepthC]);
    edge.store(rows_[kEdge]);
    multiply_add(edge, Floats8::splat(6 * block.extent), Floats8::splat(start_noise_)).store(rows_[kNoise]);
    const uint32_t missed = below(edge, greatest_low) & below(least_high, Floats8::splat(0) - edge);
    const uint32_t triangles = ~missed & ((1u << block.count) - 1u);
    tests_ += block.count;
    ray_tests_ += static_cast<uint32_t>(__builtin_popcount(triangles));
    return triangles;
  }

  // Returns whether the triangle in lane `lane` of the current block may be hit by a ray, if t is ignored.
  inline bool is_near(uint32_t lane) const {
    const Weights weights = weights_of(lane);
    const Floats16 edge = splat(kEdge, lane);
    return (signs_of(greater_equal_mask(weights.least, Floats16::splat(0) - edge)) |
            signs_of(greater_equal_mask(edge, weights.greatest))) != 0;
  }

  // Tests the triangle in lane `lane` of the current block with all rays in float, and records certain hits. Returns
  // the mask of the rays for which resolve_rays() must decide.
  template <bool kAny>
  inline uint32_t test_triangle(uint32_t lane) {
    const Weights weights = weights_of(lane);
    const Floats16 zero = Floats16::splat(0), edge = splat(kEdge, lane), minus_edge = zero - edge;
    const Floats16 determinant = weights.a + weights.b + weights.c, inverse = Floats16::splat(1) / determinant;
    const Floats16 beyond_a = multiply_add(weights.b, splat(kDepthB, lane), weights.c * splat(kDepthC, lane));
    const Floats16 depth = multiply_add(beyond_a, inverse, splat(kDepthA, lane));
    Floats16 error = multiply_add(splat(kNoise, lane), absolute(inverse), Floats16::splat(depth_floor_));
    if (planted(PlantedBug::kKernelTBound)) error = zero;
    const Floats16 earliest = depth - error, latest = depth + error, limit = Floats16::load(limits_);
    Floats16 edge_on = greater_equal_mask(Floats16::splat(8) * edge, absolute(determinant));
    if (planted(PlantedBug::kKernelEdgeOn)) edge_on = zero;
    const Floats16 inside =
        bit_or(greater_equal_mask(weights.least, minus_edge), greater_equal_mask(edge, weights.greatest));
    const Floats16 in_reach = bit_and(greater_equal_mask(limit, earliest), greater_equal_mask(latest, zero));
    const Floats16 candidate = bit_and(bit_and(inside, greater_equal_mask(limit, zero)), bit_or(edge_on, in_reach));
    const uint32_t candidates = signs_of(candidate), block_index = now & ~kBlockBit;
    const Floats16 faces = bit_or(bit_and(Floats16::load(front_mask_), greater_mask(weights.least, edge)),
                                  bit_and(Floats16::load(back_mask_), greater_mask(minus_edge, weights.greatest)));
    const Floats16 within =
        bit_and(greater_mask(earliest, zero), greater_equal_mask(limit, latest * Floats16::splat(1 + 0x1p-20f)));
    const Floats16 certain = bit_and_not(edge_on, bit_and(bit_and(candidate, faces), within));
    uint32_t settled;
    if constexpr (kAny) {
      settled = signs_of(certain);
      found_ |= settled;
      for (uint32_t rest = settled; rest != 0; rest &= rest - 1u) best_numbers_[__builtin_ctz(rest)] = block_index;
      select(certain, Floats16::splat(kNever), limit).store(limits_);
    } else {
      // The triangle replaces the nearest one so far of each ray that certainly hits it before that one.
      const Floats16 stored = Floats16::load(earliest_), nearer = bit_and(certain, greater_mask(stored, latest));
      settled = signs_of(nearer);
      select(nearer, earliest, stored).store(earliest_);
      select(nearer, latest, limit).store(limits_);
      float* const references = reinterpret_cast<float*>(nearest_);
      const Floats16 reference = Floats16::both(bits_of(block_index * kTreeWidth + lane));
      select(nearer, reference, Floats16::load(references)).store(references);
    }
    return candidates & ~settled;
  }

  // Tests in double whether the rays in the mask `rays` hit the triangle in lane `lane` of the current block.
  template <bool kAny>
  inline void resolve_rays(uint32_t lane, uint32_t rays) {
    for (; rays != 0; rays &= rays - 1u)
      resolve<kAny>(tree_->blocks[now & ~kBlockBit], lane, static_cast<uint32_t>(__builtin_ctz(rays)));
  }

  // Updates the greatest limit after the triangles of a block were tested. Ends the beam if it has tested too many
  // triangles.
  inline void finish_block() {
    limit_ = greatest(Floats16::load(limits_));
    if (tests_ <= kMaxKernelTests && ray_tests_ <= kMaxRayTests) return;
    gave_up_ = true;
    limit_ = kNever;
  }

  // Writes the answers of the rays. Returns false, and writes nothing, if the beam has tested too many triangles; the
  // rays must then be traced in another way.
  template <bool kAny>
  inline bool finish(KernelHit* hits) {
    if (gave_up_) return false;
    if constexpr (!kAny) resolve_nearest();
    write_hits(hits);
    hits[0].nodes = nodes_;
    hits[0].tests = tests_ + ray_tests_;
    return true;
  }

 private:
  static constexpr float kNever = -1;  // limit of a ray that needs no more tests
  // Greatest number of triangles that are tested with all rays; with more triangles, single rays are faster.
  static constexpr uint32_t kMaxRayTests = 96;
  // Factor that covers the rounding of a product of t and a component of the direction.
  static constexpr float kUp = 1 + 0x1p-21f;
  // Greatest difference of the shears of a beam's rays from those of its middle. Wider beams test too many triangles
  // with rays that are not near.
  static constexpr float kMaxHalfSpread = 0.12f;

  // Eight triangles of a block, projected along the middle ray: one row for each constant of the test.
  enum Row : uint32_t {
    kWeightA = 0,
    kWeightB = 3,
    kWeightC = 6,
    kDepthA = 9,
    kDepthB,
    kDepthC,
    kEdge,
    kNoise,
    kRowCount
  };
  inline Floats16 splat(uint32_t row, uint32_t lane) const { return Floats16::splat(rows_[row][lane]); }

  // Edge functions of one triangle for all rays.
  struct Weights {
    Floats16 a, b, c, least, greatest;
  };
  inline Weights weights_of(uint32_t lane) const {
    const Floats16 u = Floats16::load(us_), v = Floats16::load(vs_);
    const auto weight = [&](uint32_t row) {
      return multiply_add(u, splat(row + 1, lane), multiply_add(v, splat(row + 2, lane), splat(row, lane)));
    };
    const Floats16 a = weight(kWeightA), b = weight(kWeightB), c = weight(kWeightC);
    return {a, b, c, minimum(a, minimum(b, c)), maximum(a, maximum(b, c))};
  }
  static inline bool same_origins(const KernelRay* rays) {
    static_assert(offsetof(KernelRay, direction) == 3 * sizeof(double));
    // Each row has the three components of an origin and one of the direction.
    DoubleMask first, second, differences;
    __builtin_memcpy(&first, rays[0].origin, sizeof(first));
    __builtin_memcpy(&second, rays[1].origin, sizeof(second));
    differences = first ^ second;
    if ((differences[0] | differences[1] | differences[2]) != 0) return false;
    for (uint32_t i = 2; i < kBeamRays; ++i) {
      DoubleMask other;
      __builtin_memcpy(&other, rays[i].origin, sizeof(other));
      differences |= first ^ other;
    }
    return (differences[0] | differences[1] | differences[2]) == 0;
  }

  inline void load_directions(Floats16* direction) const {
    const double* rows[kBeamRays];
    for (uint32_t i = 0; i < kBeamRays; ++i) rows[i] = rays_[i].direction;
    Floats8 low[3], high[3];
    transpose_three(rows, low);
    transpose_three(rows + kTreeWidth, high);
    for (uint32_t k = 0; k < 3; ++k) direction[k] = {low[k], high[k]};
  }

  // Sets the octant and the axes of projection. Returns false unless the rays share them, and the largest component of
  // each direction is larger than the other components even in float, so that TriangleRay chooses the same axis.
  inline bool choose_axes(const Floats16* direction) {
    octant_ = 0;
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t signs = signs_of(direction[k]);
      if (signs != 0 && signs != kAllBeamRays) return false;
      octant_ |= signs & (1u << k);
    }
    const Floats16 lengths[3] = {absolute(direction[0]), absolute(direction[1]), absolute(direction[2])};
    const Floats16 longest = maximum(maximum(lengths[0], lengths[1]), lengths[2]);
    uint32_t& z = exact_.axes[2];
    for (z = 0; z < 3; ++z)
      if (at_most(longest, lengths[z]) == kAllBeamRays) break;
    if (z == 3) return false;
    const bool backwards = (octant_ >> z & 1u) != 0;
    exact_.axes[0] = (z + (backwards ? 2u : 1u)) % 3;
    exact_.axes[1] = (z + (backwards ? 1u : 2u)) % 3;
    return (at_most(longest, lengths[exact_.axes[0]]) | at_most(longest, lengths[exact_.axes[1]])) == 0;
  }

  // Sets the middle ray, the differences of the rays from it, and the slopes of the frustum. Returns false if the
  // differences are too large.
  inline bool set_shears(const Floats16* direction) {
    const Floats16 along = direction[exact_.axes[2]], reciprocal = Floats16::splat(1) / along;
    absolute(along).store(lengths_);
    sign_ = sign_of(exact_.axes[2]);
    slope(exact_.axes[2], 1, 1);
    const auto spread = [&](uint32_t axis, float& middle, float* differences) {
      const Floats16 shear = direction[axis] * reciprocal;
      const float low = least(shear), high = greatest(shear);
      middle = 0.5f * (low + high);
      (shear - Floats16::splat(middle)).store(differences);
      slope(axis, __builtin_fabsf(low), __builtin_fabsf(high));
      return larger(high - middle, middle - low);
    };
    spread_u_ = spread(exact_.axes[0], shear_x_, us_);
    spread_v_ = spread(exact_.axes[1], shear_y_, vs_);
    if (planted(PlantedBug::kKernelBeamMiddle)) spread_u_ = spread_v_ = 0;
    return spread_u_ <= kMaxHalfSpread && spread_v_ <= kMaxHalfSpread;
  }

  inline float sign_of(uint32_t axis) const { return (octant_ >> axis & 1u) != 0 ? -1.0f : 1.0f; }

  // Sets the reciprocals of the least and the greatest slope of the rays along a mesh axis. A slope of less than 1e-18
  // is replaced by 1e-18, as in SlabRay.
  inline void slope(uint32_t axis, float one, float other) {
    steep_[axis] = sign_of(axis) / larger(one < other ? one : other, 1e-18f);
    flat_[axis] = sign_of(axis) / larger(one < other ? other : one, 1e-18f);
  }

  // Sets the rest of the frustum and the error bounds. The frustum enters a slab no later, and leaves it no earlier,
  // than any of the rays. Its pad is twice that of the rays, which covers the rounding of the frustum's own test.
  inline void set_frustum() {
    float reach = 0;
    for (uint32_t k = 0; k < 3; ++k) {
      origin_[k] = static_cast<float>(rays_[0].origin[k]);
      reach = larger(reach, __builtin_fabsf(origin_[k]));
    }
    reach += tree_->magnitude;
    for (uint32_t k = 0; k < 3; ++k)
      pads_[k] = planted(PlantedBug::kKernelTreePad) ? 0 : 2 * kTreePad * reach * __builtin_fabsf(steep_[k]);
    reach_ = reach;
    exact_.scale = reach * 0x1p-17f;
    exact_.floor = reach * reach * 0x1p-36f;
    start_noise_ = reach * reach * reach * 0x1p-42f;
    depth_floor_ = reach * 0x1p-20f;
  }

  inline void load_limits() {
    static_assert(offsetof(KernelRay, accept_front) == offsetof(KernelRay, limit) + 4);
    static_assert(offsetof(KernelRay, accept_back) == offsetof(KernelRay, limit) + 5);
    static_assert(sizeof(KernelRay) >= offsetof(KernelRay, limit) + 16);
    const char* const from = reinterpret_cast<const char*>(rays_) + offsetof(KernelRay, limit);
    Floats16 limits, flags;
    load_pairs(from, sizeof(KernelRay), limits.low, flags.low);
    load_pairs(from + kTreeWidth * sizeof(KernelRay), sizeof(KernelRay), limits.high, flags.high);
    front_ = have_bits(flags.low, 1) | have_bits(flags.high, 1) << kTreeWidth;
    back_ = have_bits(flags.low, 0x100) | have_bits(flags.high, 0x100) << kTreeWidth;
    mask_of(front_).store(front_mask_);
    mask_of(back_).store(back_mask_);
    limits.store(best_t_);
    limits = limits * Floats16::load(lengths_) * Floats16::splat(kUp);
    limits.store(limits_);
    limit_ = greatest(limits);
    Floats16::both(bits_of(kNoNumber)).store(reinterpret_cast<float*>(nearest_));
    Floats16::both(bits_of(kNoNumber)).store(reinterpret_cast<float*>(best_numbers_));
    Floats16::splat(__builtin_inff()).store(earliest_);
    found_ = undecided_ = nodes_ = tests_ = ray_tests_ = 0;
    gave_up_ = false;
    now = 0;
    waiting_[0] = kNoChild;
    nears_[0] = kNever;
    top_ = 1;
  }

  inline uint32_t index_of(const TriangleBlock& block) const { return static_cast<uint32_t>(&block - tree_->blocks); }

  // Tests in double whether ray `i` hits the triangle, and records the hit.
  template <bool kAny>
  inline void resolve(const TriangleBlock& block, uint32_t lane, uint32_t i) {
    if (limits_[i] < 0) return;
    BeamConstants constants = exact_;
    constants.noise = start_noise_ / lengths_[i];
    constants.least_t = depth_floor_ / lengths_[i];
    const Verdict verdict = decide(block, static_cast<int>(lane), rays_[i], constants);
    if (verdict.verdict == KernelVerdict::kUndecided) {
      undecided_ |= 1u << i;
      limits_[i] = kNever;
    }
    if (verdict.verdict != KernelVerdict::kHit) return;
    record_hit<kAny>(i, verdict.t, kAny ? index_of(block) : number_of(*tree_, block, static_cast<int>(lane)));
  }

  template <bool kAny>
  inline void record_hit(uint32_t i, float t, uint32_t number) {
    if (!is_better(t, number, best_t_[i], (found_ >> i & 1u) != 0, best_numbers_[i])) return;
    found_ |= 1u << i;
    best_t_[i] = t;
    best_numbers_[i] = number;
    const float limit = kAny ? kNever : t * lengths_[i] * kUp;
    if (limit < limits_[i]) limits_[i] = limit;
  }

  // Computes in double the hits on the nearest triangles, four rays at a time.
  inline void resolve_nearest() {
    const Floats16 earliest = Floats16::load(earliest_), most = Floats16::splat(__FLT_MAX__);
    uint32_t wanted = at_most(earliest, minimum(Floats16::load(limits_), most));
    for (uint32_t first = 0; wanted != 0; first += 4, wanted >>= 4)
      if ((wanted & 15u) != 0) resolve_four(first, wanted & 15u);
  }

  inline void resolve_four(uint32_t first, uint32_t wanted) {
    FourPairs pairs;
    pairs.rays = rays_ + first;
    pairs.front = front_ >> first;
    pairs.back = back_ >> first;
    const uint32_t some = nearest_[first + static_cast<uint32_t>(__builtin_ctz(wanted))];
    uint32_t differences = 0;
    for (uint32_t k = 0; k < 4; ++k) {
      const uint32_t reference = (wanted >> k & 1u) != 0 ? nearest_[first + k] : some;
      differences |= reference ^ some;
      pairs.blocks[k] = &tree_->blocks[reference / kTreeWidth];
      pairs.lanes[k] = reference % kTreeWidth;
    }
    const FourVerdicts verdicts =
        differences == 0 ? decide_four<true>(pairs, exact_) : decide_four<false>(pairs, exact_);
    const auto number = [&](uint32_t k) {
      return number_of(*tree_, *pairs.blocks[k], static_cast<int>(pairs.lanes[k]));
    };
    if (wanted == 15u && (verdicts.hits & ~(found_ >> first) & 15u) == 15u) {
      found_ |= wanted << first;
      for (uint32_t k = 0; k < 4; ++k) {
        best_t_[first + k] = verdicts.t[k];
        best_numbers_[first + k] = number(k);
      }
      return;
    }
    for (; wanted != 0; wanted &= wanted - 1u) {
      const auto k = static_cast<uint32_t>(__builtin_ctz(wanted));
      if ((verdicts.hits >> k & 1u) != 0)
        record_hit<false>(first + k, verdicts.t[k], number(k));
      else if ((verdicts.unsure >> k & 1u) != 0)
        resolve<false>(*pairs.blocks[k], pairs.lanes[k], first + k);
    }
  }

  inline void write_hits(KernelHit* hits) const {
    static_assert(offsetof(KernelHit, verdict) == 8 && offsetof(KernelHit, nodes) == 12);
    static_assert(KernelVerdict{} == KernelVerdict::kMiss);
    const Floats16 zero = Floats16::both(bits_of(0));
    const auto verdict = [](KernelVerdict value) { return Floats16::both(bits_of(static_cast<uint32_t>(value))); };
    const Floats16 verdicts = select(mask_of(undecided_), verdict(KernelVerdict::kUndecided),
                                     select(mask_of(found_), verdict(KernelVerdict::kHit), zero));
    const Floats16 t = Floats16::load(best_t_), numbers = Floats16::load(reinterpret_cast<const float*>(best_numbers_));
    const Floats8 low[4] = {t.low, numbers.low, verdicts.low, zero.low},
                  high[4] = {t.high, numbers.high, verdicts.high, zero.high};
    store_rows(low, reinterpret_cast<char*>(hits), sizeof(KernelHit));
    store_rows(high, reinterpret_cast<char*>(hits + kTreeWidth), sizeof(KernelHit));
    for (uint32_t i = 0; i < kBeamRays; ++i) hits[i].tests = 0;
  }

  const TriangleTree* tree_;
  const KernelRay* rays_;
  uint32_t octant_;
  BeamConstants exact_;                             // the constants that all rays share
  float start_noise_, depth_floor_;                 // those of exact_ for a ray whose largest component is 1
  float reach_;                                     // R
  float origin_[3], steep_[3], flat_[3], pads_[3];  // the frustum, by mesh axis
  float shear_x_, shear_y_;                         // of the middle ray
  float sign_;                                      // sign of the directions along the axis of projection
  float spread_u_, spread_v_;                       // the largest |u| and |v|
  float limit_;                                     // the greatest limit of all rays
  uint32_t front_, back_;       // masks of the rays that accept a triangle seen from the front or back
  uint32_t found_, undecided_;  // masks of the rays with a hit, and of those that are undecided
  uint32_t nodes_, tests_;      // number of nodes opened, and of triangles in the blocks opened
  uint32_t ray_tests_;          // number of triangles tested with all rays
  alignas(64) float us_[kBeamRays];
  alignas(64) float vs_[kBeamRays];
  alignas(64) float lengths_[kBeamRays];  // of the directions, along the axis of projection
  alignas(64) float limits_[kBeamRays];   // as depths, raised by their rounding
  // The nearest triangle that each ray certainly hits, as block * 8 + lane, and a lower bound of its depth.
  alignas(64) uint32_t nearest_[kBeamRays];
  alignas(64) float earliest_[kBeamRays];
  alignas(64) float best_t_[kBeamRays];  // the best hit in double, or the ray's own limit
  alignas(64) uint32_t best_numbers_[kBeamRays];
  alignas(64) float front_mask_[kBeamRays];  // front_ and back_, as masks for select()
  alignas(64) float back_mask_[kBeamRays];
  alignas(64) float rows_[kRowCount][kTreeWidth];  // the triangles of the current block
  bool gave_up_;
  // Stack of the nodes and blocks that wait, above the sentinel kNoChild.
  uint32_t top_;
  alignas(64) uint32_t waiting_[kTreeStack];
  float nears_[kTreeStack];
};

// Traces up to kMaxBeams beams interleaved: steps of the same kind are executed for all beams, one after the other. A
// step of one beam depends on its previous step, so that the processor would wait if it traced one beam at a time. No
// loop over beams has a branch that is often mispredicted.
template <bool kAny>
class BeamStream {
 public:
  static inline void run(Beam* beams, uint32_t count) { BeamStream(beams, count).trace(); }

 private:
  struct Pair {
    uint8_t beam, lane;
  };
  struct Unsettled {
    Pair pair;
    uint32_t rays;
  };

  inline BeamStream(Beam* beams, uint32_t count) : beams_(beams) {
    for (uint32_t i = 0; i < count; ++i) lists_[0][i] = static_cast<uint8_t>(i);
    counts_[0] = count;
  }

  inline void trace() {
    while (counts_[0] + counts_[1] != 0) {
      for (uint32_t i = 0; i < counts_[0]; ++i) beams_[lists_[0][i]].open_node();
      if (counts_[1] != 0) open_blocks();
      pop_all();
    }
  }

  inline void open_blocks() {
    uint32_t pairs = 0, near = 0, unsettled = 0;
    for (uint32_t i = 0; i < counts_[1]; ++i) {
      const uint8_t beam = lists_[1][i];
      const uint32_t triangles = beams_[beam].project_block();
      for (uint8_t lane = 0; lane < kTreeWidth; ++lane) {
        pairs_[pairs] = {beam, lane};
        pairs += triangles >> lane & 1u;
      }
    }
    for (uint32_t i = 0; i < pairs; ++i) {
      const Pair pair = pairs_[i];
      pairs_[near] = pair;
      near += beams_[pair.beam].is_near(pair.lane) ? 1u : 0u;
    }
    for (uint32_t i = 0; i < near; ++i) {
      const Pair pair = pairs_[i];
      const uint32_t rays = beams_[pair.beam].template test_triangle<kAny>(pair.lane);
      unsettled_[unsettled] = {pair, rays};
      unsettled += rays != 0 ? 1u : 0u;
    }
    for (uint32_t i = 0; i < unsettled; ++i) {
      const Unsettled& one = unsettled_[i];
      beams_[one.pair.beam].template resolve_rays<kAny>(one.pair.lane, one.rays);
    }
    for (uint32_t i = 0; i < counts_[1]; ++i) beams_[lists_[1][i]].finish_block();
  }

  inline void pop_all() {
    uint8_t lists[3][kMaxBeams];
    uint32_t counts[3] = {};
    for (uint32_t kind = 0; kind < 2; ++kind) {
      for (uint32_t i = 0; i < counts_[kind]; ++i) {
        Beam& beam = beams_[lists_[kind][i]];
        beam.pop_next();
        const uint32_t next = (beam.now >> 31) + (beam.now == kNoChild ? 1u : 0u);
        lists[next][counts[next]++] = lists_[kind][i];
      }
    }
    __builtin_memcpy(lists_, lists, sizeof(lists_));
    counts_[0] = counts[0];
    counts_[1] = counts[1];
  }

  Beam* const beams_;
  uint8_t lists_[2][kMaxBeams];  // indices of the beams whose current reference is a node, and a block
  uint32_t counts_[2] = {};
  Pair pairs_[kMaxBeams * kTreeWidth + 1];
  Unsettled unsettled_[kMaxBeams * kTreeWidth + 1];
};

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_BEAM_IMPL_H_
