// Packet of eight coherent rays, traced through one tree together: each box and each triangle is tested with all eight
// rays. Rays are coherent if they are close to each other and have similar directions. Simulated cameras and sensors
// generate coherent rays. The tests of a ray use the same arithmetic as if the ray were traced alone, so the answer to
// the ray is the same in both cases. Boxes that no ray can hit are culled first, eight at a time, by a frustum around
// the rays. Several packets take steps in turn, so that one packet continues while another waits for memory.
//
// Source: Wald, Slusallek, Benthin, Wagner, Interactive Rendering with Coherent Ray Tracing, 2001.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_PACKET_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_PACKET_IMPL_H_

#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/ray_answer_impl.h"
#include "core/index/bvh/kernels/ray_block_impl.h"
#include "core/index/bvh/kernels/ray_setup_impl.h"

namespace locus {
namespace {

// Returns whether eight rays are coherent. Packet requires that their directions lie in the same octant and have their
// largest component along the same mesh axis. For speed, the directions must also lie within a narrow cone, and the
// origins must be close to each other compared to `magnitude`, the largest |coordinate| of the mesh.
static inline bool are_coherent(const PreparedRays& rays, float magnitude) {
  constexpr float kMaxSpread = 0.03f;
  const auto differ = [&](uint32_t column, float max_difference) {
    const Floats8 difference = absolute(Floats8::load(rays.columns[column]) - Floats8::splat(rays.columns[column][0]));
    return at_most(difference, Floats8::splat(max_difference)) != 255u;
  };
  for (uint32_t column = kFromX; column <= kFromZ; ++column)
    if (differ(column, kMaxSpread * magnitude)) return false;
  if (differ(kShearX, kMaxSpread) || differ(kShearY, kMaxSpread)) return false;
  // The octant and the axis are compared as integers: as floats their bits are denormal numbers, which would compare
  // equal if the host process treats denormals as zero.
  const PreparedRay first(rays, 0);
  uint32_t different = 0;
  for (uint32_t i = 1; i < kTreeWidth; ++i) {
    const PreparedRay other(rays, i);
    different |= (other.integer(kOctant) ^ first.integer(kOctant)) | (other.integer(kAxisZ) ^ first.integer(kAxisZ));
  }
  return different == 0;
}

// Eight coherent rays and the state of their traversal.
template <bool kAny>
class Packet {
 public:
  // Starts eight rays at the root of the tree. `rays` and `hits` have eight elements. Borrows all arguments until
  // step() returns false.
  inline void start(const TriangleTree& tree, const KernelRay* rays, const PreparedRays& prepared, KernelHit* hits) {
    tree_ = &tree;
    rays_ = rays;
    prepared_ = &prepared;
    hits_ = hits;
    Floats8::load(prepared.columns[kLimit]).store(limits_);
    for (uint32_t k = 0; k < 3; ++k) {
      slabs_.reciprocal[k] = Floats8::load(prepared.columns[kReciprocal + k]);
      slabs_.near_offset[k] = Floats8::load(prepared.columns[kNearOffset + k]);
      slabs_.far_offset[k] = Floats8::load(prepared.columns[kFarOffset + k]);
    }
    compute_frustum();
    front_ = back_ = nodes_ = 0;
    for (uint32_t i = 0; i < kTreeWidth; ++i) {
      hits[i] = {limits_[i], kNoNumber, KernelVerdict::kMiss, 0, 0};
      candidate_counts_[i] = 0;
      front_ |= (rays[i].accept_front ? 1u : 0u) << i;
      back_ |= (rays[i].accept_back ? 1u : 0u) << i;
    }
    waiting_[0] = {Floats8::splat(0), 255, 0};
    top_ = 1;
  }

  // Opens one node or block and returns true. If no node or block is left, completes the answers and returns false;
  // step() must not be called again before start().
  inline bool step() {
    while (top_ != 0) {
      // `now` is a reference, because the compiler would store a copy in two halves, and the load of the whole vector
      // that follows would stall.
      const Waiting& now = waiting_[--top_];
      const uint32_t reference = now.reference;
      // The rays' limits may have decreased since the box was pushed. A box that a ray enters exactly at its limit is
      // opened: it may hold a hit at the same t with a lower triangle number.
      const Floats8 limit = Floats8::load(limits_);
      const uint32_t rays =
          now.rays & (planted(PlantedBug::kKernelPruneEqual) ? below(now.near, limit) : at_most(now.near, limit));
      if (rays == 0) continue;
      if ((reference & kBlockBit) == 0)
        top_ = open_node(tree_->nodes[reference], top_);
      else
        open_block(tree_->blocks[reference & ~kBlockBit], rays);
      prefetch_next();
      return true;
    }
    for (uint32_t i = 0; i < kTreeWidth; ++i) resolve_candidates(i);
    hits_[0].nodes = nodes_;
    return false;
  }

 private:
  static constexpr uint32_t kMaxCandidates = 4;
  static constexpr float kNever = -1;  // limit of a ray that needs no more tests

  struct Waiting {
    Floats8 near;   // t at which each ray enters the box
    uint32_t rays;  // mask of the rays that hit the box
    uint32_t reference;
  };

  // Triangle that a ray certainly hits, at a t that is still to be computed in double.
  struct Candidate {
    const TriangleBlock* block;
    uint32_t lane;
    float earliest;  // lower bound of t
  };

  struct Slabs {
    Floats8 reciprocal[3], near_offset[3], far_offset[3];
  };

  // Prefetches the next node or block, so that it is loaded while other packets take their steps.
  inline void prefetch_next() const {
    if (top_ == 0) return;
    const uint32_t reference = waiting_[top_ - 1].reference;
    if ((reference & kBlockBit) == 0)
      prefetch(&tree_->nodes[reference], sizeof(TriangleNode));
    else
      prefetch(&tree_->blocks[reference & ~kBlockBit], sizeof(TriangleBlock));
  }

  // Frustum around the rays, with equal values in all lanes: bounds of the rays' origins and reciprocal directions. The
  // frustum enters a slab no later, and leaves it no earlier, than any of the rays. `pad` is twice the largest pad of
  // the rays, which covers the rounding of the frustum's own test.
  struct RayFrustum {
    Floats8 near_origin[3], far_origin[3], min_reciprocal[3], max_reciprocal[3], pad[3];
  };

  static inline Floats8 horizontal_min(Floats8 a) { return Floats8::splat(0) - horizontal_max(Floats8::splat(0) - a); }

  inline void compute_frustum() {
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t world = axis(kAxisX + k);
      const Floats8 origin = Floats8::load(prepared_->columns[kFromX + k]);
      const bool negative = (axis(kOctant) >> world & 1u) != 0;
      frustum_.near_origin[world] = negative ? horizontal_min(origin) : horizontal_max(origin);
      frustum_.far_origin[world] = negative ? horizontal_max(origin) : horizontal_min(origin);
      frustum_.min_reciprocal[world] = horizontal_min(slabs_.reciprocal[world]);
      frustum_.max_reciprocal[world] = horizontal_max(slabs_.reciprocal[world]);
      frustum_.pad[world] = horizontal_max(slabs_.near_offset[world] - slabs_.far_offset[world]);
    }
  }

  // Writes the slots whose boxes the frustum hits, from far to near, in the lowest three bits of the elements of
  // `slots`. Returns the number of these slots.
  inline uint32_t slots_hit(const TriangleNode& node, uint32_t octant, Floats8 limit, uint32_t* slots) const {
    const float* const bounds = node.bounds[0];
    Floats8 near[3], far[3];
    for (uint32_t k = 0; k < 3; ++k) {
      const Floats8 entry = Floats8::load(bounds + kRows.entered[octant][k]) - frustum_.near_origin[k];
      const Floats8 exit = Floats8::load(bounds + kRows.left[octant][k]) - frustum_.far_origin[k];
      near[k] = minimum(entry * frustum_.min_reciprocal[k], entry * frustum_.max_reciprocal[k]) - frustum_.pad[k];
      far[k] = maximum(exit * frustum_.min_reciprocal[k], exit * frustum_.max_reciprocal[k]) + frustum_.pad[k];
    }
    const Floats8 entered = maximum(maximum(near[0], near[1]), maximum(near[2], Floats8::splat(0)));
    const Floats8 left = minimum(minimum(far[0], far[1]), minimum(far[2], horizontal_max(limit)));
    return pack_slots(node, entered, left, octant, slots);
  }

  // Pushes the children of `node` that any of the rays may hit, the nearest one last. Returns the new top of the stack.
  inline uint32_t open_node(const TriangleNode& node, uint32_t top) {
    ++nodes_;
    // Local copies, because the compiler would reload the members after each store to waiting_.
    const Slabs slabs = slabs_;
    const Floats8 limit = Floats8::load(limits_);
    const uint32_t octant = axis(kOctant);
    uint32_t slots[kTreeWidth];
    const uint32_t count = slots_hit(node, octant, limit, slots);
    const uint32_t* const rows_in = kRows.entered[octant];
    const uint32_t* const rows_out = kRows.left[octant];
    for (uint32_t i = 0; i < count; ++i) {
      const uint32_t slot = slots[i] & 7u;
      const float* const bounds = node.bounds[0] + slot;
      const auto near = [&](uint32_t k) {
        return multiply_subtract(Floats8::splat(bounds[rows_in[k]]), slabs.reciprocal[k], slabs.near_offset[k]);
      };
      const auto far = [&](uint32_t k) {
        return multiply_subtract(Floats8::splat(bounds[rows_out[k]]), slabs.reciprocal[k], slabs.far_offset[k]);
      };
      const Floats8 entered = maximum(maximum(near(0), near(1)), maximum(near(2), Floats8::splat(0)));
      const uint32_t hit = at_most(entered, minimum(minimum(far(0), far(1)), minimum(far(2), limit)));
      waiting_[top] = {entered, hit, node.child[slot]};
      top += hit != 0 ? 1 : 0;
    }
    return top;
  }

  // Tests the rays in the mask `rays` with a block. If few rays hit the block's box, tests one ray after the other,
  // each with eight triangles together; otherwise one triangle after the other, each with eight rays together.
  inline void open_block(const TriangleBlock& block, uint32_t rays) {
    for (uint32_t i = 0; i < kTreeWidth; ++i) hits_[i].tests += (rays >> i & 1u) * block.count;
    constexpr int kRayCost = 5, kTriangleCost = 2;  // measured relative costs
    if (__builtin_popcount(rays) * kRayCost < static_cast<int>(block.count) * kTriangleCost)
      test_by_ray(block, rays);
    else
      test_by_triangle(block, rays);
    for (uint32_t i = 0; i < kTreeWidth; ++i)
      if (hits_[i].tests > kMaxKernelTests) give_up(i);
  }

  inline void test_by_ray(const TriangleBlock& block, uint32_t rays) {
    for (; rays != 0; rays &= rays - 1u) {
      const auto i = static_cast<uint32_t>(__builtin_ctz(rays));
      const BlockResults results = test_block<kAny>(block, PreparedRay(*prepared_, i), limits_[i], rays_[i]);
      if (results.certain != 0) {
        record_any_hit(i, block);
        continue;
      }
      for (uint32_t candidates = results.candidates; candidates != 0; candidates &= candidates - 1u)
        resolve(block, __builtin_ctz(candidates), i);
    }
  }

  inline void test_by_triangle(const TriangleBlock& block, uint32_t rays) {
    alignas(32) float earliest[kTreeWidth], latest[kTreeWidth];
    Pairs pairs = pairs_with(block);
    const uint32_t x = axis(kAxisX), y = axis(kAxisY), z = axis(kAxisZ);
    for (uint32_t lane = 0; lane < block.count; ++lane) {
      for (uint32_t vertex = 0; vertex < 3; ++vertex) {
        pairs.xs[vertex] = Floats8::splat(block.vertices[x + 3 * vertex][lane]);
        pairs.ys[vertex] = Floats8::splat(block.vertices[y + 3 * vertex][lane]);
        pairs.zs[vertex] = Floats8::splat(block.vertices[z + 3 * vertex][lane]);
      }
      const PairResults results = test_pairs(pairs);
      uint32_t candidates = results.candidates & rays;
      if (candidates == 0) continue;
      const uint32_t certain = certain_hits(pairs, results, front_, back_);
      results.earliest.store(earliest);
      results.latest.store(latest);
      for (; candidates != 0; candidates &= candidates - 1u) {
        const auto i = static_cast<uint32_t>(__builtin_ctz(candidates));
        if ((certain >> i & 1u) == 0)
          resolve(block, static_cast<int>(lane), i);
        else if (kAny)
          record_any_hit(i, block);
        else
          add_candidate(i, {&block, lane, earliest[i]}, latest[i]);
        if (limits_[i] < 0) rays &= ~(1u << i);
      }
      pairs.limit = Floats8::load(limits_);
    }
  }

  // Returns the integer in `column`, an axis or the octant, which is equal for all rays of the packet.
  inline uint32_t axis(uint32_t column) const { return PreparedRay(*prepared_, 0).integer(column); }

  // Returns pairs of the eight rays with a triangle of `block`. Sets all members except the coordinates of the
  // triangle's vertices (xs, ys, zs).
  inline Pairs pairs_with(const TriangleBlock& block) const {
    const auto column = [&](uint32_t index) { return Floats8::load(prepared_->columns[index]); };
    const Floats8 extent = Floats8::splat(block.extent);
    Pairs pairs;
    pairs.from_x = column(kFromX);
    pairs.from_y = column(kFromY);
    pairs.from_z = column(kFromZ);
    pairs.shear_x = column(kShearX);
    pairs.shear_y = column(kShearY);
    pairs.reciprocal_z = column(kReciprocalZ);
    pairs.limit = Floats8::load(limits_);
    pairs.edge =
        planted(PlantedBug::kKernelEdgeBound) ? Floats8::splat(0) : column(kEdgeScale) * extent + column(kEdgeFloor);
    pairs.noise = pairs.edge * extent * column(kEdgeNoise) + column(kStartNoise);
    pairs.t_floor = column(kTFloor);
    return pairs;
  }

  // Adds a triangle that ray `i` certainly hits. The exact t of the hit is computed later, because a hit that is found
  // early is seldom the nearest. `limit` is an upper bound of the t of the hit. If `limit` is lower than the ray's
  // limit, it becomes the new limit of the ray, and candidates beyond the new limit are removed.
  inline void add_candidate(uint32_t i, const Candidate& candidate, float limit) {
    if (limit < limits_[i]) {
      limits_[i] = limit;
      uint32_t kept = 0;
      for (uint32_t k = 0; k < candidate_counts_[i]; ++k) {
        candidates_[i][kept] = candidates_[i][k];
        kept += candidates_[i][k].earliest <= limit ? 1 : 0;
      }
      candidate_counts_[i] = kept;
    }
    if (candidate_counts_[i] == kMaxCandidates) resolve_candidates(i);
    candidates_[i][candidate_counts_[i]++] = candidate;
  }

  inline void resolve_candidates(uint32_t i) {
    for (uint32_t k = 0; k < candidate_counts_[i]; ++k) {
      const Candidate& candidate = candidates_[i][k];
      if (candidate.earliest <= limits_[i]) resolve(*candidate.block, static_cast<int>(candidate.lane), i);
    }
    candidate_counts_[i] = 0;
  }

  // Tests in double whether ray `i` hits the triangle in lane `lane`, and records the hit. Does nothing if the ray
  // needs no more tests: after give_up() a ray stays undecided, even if it hits another triangle of the same block.
  inline void resolve(const TriangleBlock& block, int lane, uint32_t i) {
    if (limits_[i] < 0 && !planted(PlantedBug::kKernelHitAfterGivingUp)) return;
    const Verdict verdict = decide(block, lane, rays_[i], PreparedConstants{PreparedRay(*prepared_, i)});
    if (verdict.verdict == KernelVerdict::kUndecided) give_up(i);
    if (verdict.verdict != KernelVerdict::kHit) return;
    record_hit(i, verdict.t, kAny ? index_of(block) : number_of(*tree_, block, lane));
  }

  inline uint32_t index_of(const TriangleBlock& block) const { return static_cast<uint32_t>(&block - tree_->blocks); }

  // Records that ray `i` hits a triangle of `block`, so that it needs no more tests (kAny only).
  inline void record_any_hit(uint32_t i, const TriangleBlock& block) {
    hits_[i].verdict = KernelVerdict::kHit;
    hits_[i].number = index_of(block);
    limits_[i] = kNever;
  }

  // Records a hit of ray `i` if it is better than the ray's best hit so far.
  inline void record_hit(uint32_t i, float t, uint32_t number) {
    KernelHit& hit = hits_[i];
    if (!is_better(t, number, hit.t, hit.verdict == KernelVerdict::kHit, hit.number)) return;
    hit.verdict = KernelVerdict::kHit;
    hit.t = t;
    hit.number = number;
    if (kAny)
      limits_[i] = kNever;
    else if (t < limits_[i])
      limits_[i] = t;
  }

  // Sets the verdict on ray `i` to kUndecided, so that the ray needs no more tests.
  inline void give_up(uint32_t i) {
    hits_[i].verdict = KernelVerdict::kUndecided;
    limits_[i] = kNever;
  }

  const TriangleTree* tree_;
  const KernelRay* rays_;
  const PreparedRays* prepared_;
  KernelHit* hits_;
  Slabs slabs_;
  RayFrustum frustum_;
  uint32_t front_, back_;  // masks of the rays that accept a triangle seen from the front or back
  uint32_t nodes_;
  uint32_t top_;
  alignas(32) float limits_[kTreeWidth];
  uint32_t candidate_counts_[kTreeWidth];
  Candidate candidates_[kTreeWidth][kMaxCandidates];
  Waiting waiting_[kTreeStack];
};

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_PACKET_IMPL_H_
