// Eight rays that go nearly the same way, through one tree together: every box and every triangle is met by all of them
// at once. Cameras and sensors ask so. Each ray meets what it would meet alone, by the same arithmetic, so that its
// answer is the same; boxes that none of them can meet are left out before, eight at a time. Packets take turns, so
// that one goes on while another waits for memory.
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

// Whether eight rays may go together: in one octant and along one axis, which they must have in common, and close
// enough to gain by it: their directions within a cone, their starts within a small part of everything.
static inline bool go_together(const PreparedRays& rays, float magnitude) {
  constexpr float kMaxSpread = 0.03f;
  const auto apart = [&](uint32_t column, float most) {
    const Floats8 off = absolute(Floats8::load(rays.columns[column]) - Floats8::all(rays.columns[column][0]));
    return at_most(off, Floats8::all(most)) != 255u;
  };
  for (uint32_t column = kFromX; column <= kFromZ; ++column)
    if (apart(column, kMaxSpread * magnitude)) return false;
  if (apart(kShearX, kMaxSpread) || apart(kShearY, kMaxSpread)) return false;
  // As the whole numbers they are: as floats they are denormal, and equal where the host takes those for zero.
  const PreparedRay first(rays, 0);
  uint32_t different = 0;
  for (uint32_t i = 1; i < kTreeWidth; ++i) {
    const PreparedRay other(rays, i);
    different |= (other.whole(kOctant) ^ first.whole(kOctant)) | (other.whole(kAxisZ) ^ first.whole(kAxisZ));
  }
  return different == 0;
}

template <bool kAny>
class Packet {
 public:
  // Eight of each, at the root.
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
    bind_beam();
    front_ = back_ = nodes_ = 0;
    for (uint32_t i = 0; i < kTreeWidth; ++i) {
      hits[i] = {limits_[i], kNoNumber, KernelVerdict::kMiss, 0, 0};
      kept_[i] = 0;
      front_ |= (rays[i].accept_front ? 1u : 0u) << i;
      back_ |= (rays[i].accept_back ? 1u : 0u) << i;
    }
    waiting_[0] = {Floats8::all(0), 255, 0};
    top_ = 1;
  }

  // Opens one node or block. False, once, at the end.
  inline bool step() {
    while (top_ != 0) {
      // By reference: a copy would be made in halves, and the processor would wait for both to read the whole.
      const Waiting& now = waiting_[--top_];
      const uint32_t reference = now.reference;
      // Limits may have fallen since. A box that starts exactly at one is opened: a lower number may wait there.
      const Floats8 limit = Floats8::load(limits_);
      const uint32_t rays =
          now.rays & (planted(PlantedBug::kKernelPruneEqual) ? below(now.near, limit) : at_most(now.near, limit));
      if (rays == 0) continue;
      if ((reference & kBlockBit) == 0)
        top_ = open_node(tree_->nodes[reference], top_);
      else
        open_block(tree_->blocks[reference & ~kBlockBit], rays);
      fetch_next();
      return true;
    }
    for (uint32_t i = 0; i < kTreeWidth; ++i) settle_kept(i);
    hits_[0].nodes = nodes_;
    return false;
  }

 private:
  static constexpr uint32_t kMaxCandidates = 4;
  static constexpr float kNever = -1;  // the limit of a ray that looks for nothing more

  struct Waiting {
    Floats8 near;
    uint32_t rays;  // that meet the box
    uint32_t reference;
  };

  // A triangle that a ray may hit, not yet decided.
  struct Candidate {
    const TriangleBlock* block;
    uint32_t place;
    float earliest;  // no hit on it comes before
  };

  struct Slabs {
    Floats8 reciprocal[3], near_offset[3], far_offset[3];
  };

  // Asks for the memory of what comes next, while other packets have their turns.
  inline void fetch_next() const {
    if (top_ == 0) return;
    const uint32_t reference = waiting_[top_ - 1].reference;
    if ((reference & kBlockBit) == 0)
      prefetch(&tree_->nodes[reference], sizeof(TriangleNode));
    else
      prefetch(&tree_->blocks[reference & ~kBlockBit], sizeof(TriangleBlock));
  }

  // All that the rays have between them, the same in all lanes: a slab is entered no earlier and left no later than by
  // any start and any direction of theirs. With twice the rays' own pad, for the roundings here.
  struct RayFrustum {
    Floats8 near_origin[3], far_origin[3], least[3], most[3], pad[3];
  };

  static inline Floats8 lowest(Floats8 a) { return Floats8::all(0) - largest(Floats8::all(0) - a); }

  inline void bind_beam() {
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t world = axis(kAxisX + k);
      const Floats8 origin = Floats8::load(prepared_->columns[kFromX + k]);
      const bool negative = (axis(kOctant) >> world & 1u) != 0;
      frustum_.near_origin[world] = negative ? lowest(origin) : largest(origin);
      frustum_.far_origin[world] = negative ? largest(origin) : lowest(origin);
      frustum_.least[world] = lowest(slabs_.reciprocal[world]);
      frustum_.most[world] = largest(slabs_.reciprocal[world]);
      frustum_.pad[world] = largest(slabs_.near_offset[world] - slabs_.far_offset[world]);
    }
  }

  // The slots that the beam meets, from far to near; returns how many.
  inline uint32_t slots_met(const TriangleNode& node, uint32_t octant, Floats8 limit, uint32_t* slots) const {
    const float* const bounds = node.bounds[0];
    Floats8 near[3], far[3];
    for (uint32_t k = 0; k < 3; ++k) {
      const Floats8 in = Floats8::load(bounds + kRows.entered[octant][k]) - frustum_.near_origin[k];
      const Floats8 out = Floats8::load(bounds + kRows.left[octant][k]) - frustum_.far_origin[k];
      near[k] = minimum(in * frustum_.least[k], in * frustum_.most[k]) - frustum_.pad[k];
      far[k] = maximum(out * frustum_.least[k], out * frustum_.most[k]) + frustum_.pad[k];
    }
    const Floats8 entered = maximum(maximum(near[0], near[1]), maximum(near[2], Floats8::all(0)));
    const Floats8 left = minimum(minimum(far[0], far[1]), minimum(far[2], largest(limit)));
    return pack_slots(node, entered, left, octant, slots);
  }

  // Puts the children that any of the rays may hit on the stack, the nearest last. Returns the new top.
  inline uint32_t open_node(const TriangleNode& node, uint32_t top) {
    ++nodes_;
    // Copies: the stores to the stack would make every turn of the loop read them again.
    const Slabs slabs = slabs_;
    const Floats8 limit = Floats8::load(limits_);
    const uint32_t octant = axis(kOctant);
    uint32_t slots[kTreeWidth];
    const uint32_t count = slots_met(node, octant, limit, slots);
    const uint32_t* const rows_in = kRows.entered[octant];
    const uint32_t* const rows_out = kRows.left[octant];
    for (uint32_t i = 0; i < count; ++i) {
      const uint32_t slot = slots[i] & 7u;
      const float* const bounds = node.bounds[0] + slot;
      const auto near = [&](uint32_t k) {
        return multiply_subtract(Floats8::all(bounds[rows_in[k]]), slabs.reciprocal[k], slabs.near_offset[k]);
      };
      const auto far = [&](uint32_t k) {
        return multiply_subtract(Floats8::all(bounds[rows_out[k]]), slabs.reciprocal[k], slabs.far_offset[k]);
      };
      const Floats8 entered = maximum(maximum(near(0), near(1)), maximum(near(2), Floats8::all(0)));
      const uint32_t met = at_most(entered, minimum(minimum(far(0), far(1)), minimum(far(2), limit)));
      waiting_[top] = {entered, met, node.child[slot]};
      top += met != 0 ? 1 : 0;
    }
    return top;
  }

  // Triangle by triangle, or ray by ray where few of the rays meet the block.
  inline void open_block(const TriangleBlock& block, uint32_t rays) {
    for (uint32_t i = 0; i < kTreeWidth; ++i) hits_[i].tests += (rays >> i & 1u) * block.count;
    constexpr int kRayCost = 5, kTriangleCost = 2;  // measured, in proportion
    if (__builtin_popcount(rays) * kRayCost < static_cast<int>(block.count) * kTriangleCost)
      meet_by_ray(block, rays);
    else
      meet_by_triangle(block, rays);
    for (uint32_t i = 0; i < kTreeWidth; ++i)
      if (hits_[i].tests > kMaxKernelTests) give_up(i);
  }

  inline void meet_by_ray(const TriangleBlock& block, uint32_t rays) {
    for (; rays != 0; rays &= rays - 1u) {
      const auto i = static_cast<uint32_t>(__builtin_ctz(rays));
      const BlockMet met = meet_block<kAny>(block, PreparedRay(*prepared_, i), limits_[i], rays_[i]);
      if (met.sure != 0) {
        find(i);
        continue;
      }
      for (uint32_t open = met.open; open != 0; open &= open - 1u) settle(block, __builtin_ctz(open), i);
    }
  }

  inline void meet_by_triangle(const TriangleBlock& block, uint32_t rays) {
    alignas(32) float earliest[kTreeWidth], latest[kTreeWidth];
    Pairs pairs = pairs_with(block);
    const uint32_t x = axis(kAxisX), y = axis(kAxisY), z = axis(kAxisZ);
    for (uint32_t place = 0; place < block.count; ++place) {
      for (uint32_t vertex = 0; vertex < 3; ++vertex) {
        pairs.xs[vertex] = Floats8::all(block.vertices[x + 3 * vertex][place]);
        pairs.ys[vertex] = Floats8::all(block.vertices[y + 3 * vertex][place]);
        pairs.zs[vertex] = Floats8::all(block.vertices[z + 3 * vertex][place]);
      }
      const PairsMet met = meet(pairs);
      uint32_t open = met.open & rays;
      if (open == 0) continue;
      const uint32_t certain = sure(pairs, met, front_, back_);
      met.earliest.store(earliest);
      met.latest.store(latest);
      for (; open != 0; open &= open - 1u) {
        const auto i = static_cast<uint32_t>(__builtin_ctz(open));
        if ((certain >> i & 1u) == 0)
          settle(block, static_cast<int>(place), i);
        else if (kAny)
          find(i);
        else
          keep(i, {&block, place, earliest[i]}, latest[i]);
        if (limits_[i] < 0) rays &= ~(1u << i);
      }
      pairs.limit = Floats8::load(limits_);
    }
  }

  // Of any of the rays: they have it in common.
  inline uint32_t axis(uint32_t column) const { return PreparedRay(*prepared_, 0).whole(column); }

  // What does not depend on the triangle.
  inline Pairs pairs_with(const TriangleBlock& block) const {
    const auto column = [&](uint32_t number) { return Floats8::load(prepared_->columns[number]); };
    const Floats8 extent = Floats8::all(block.extent);
    Pairs pairs;
    pairs.from_x = column(kFromX);
    pairs.from_y = column(kFromY);
    pairs.from_z = column(kFromZ);
    pairs.shear_x = column(kShearX);
    pairs.shear_y = column(kShearY);
    pairs.reciprocal_z = column(kReciprocalZ);
    pairs.limit = Floats8::load(limits_);
    pairs.edge =
        planted(PlantedBug::kKernelEdgeBound) ? Floats8::all(0) : column(kEdgeScale) * extent + column(kEdgeFloor);
    pairs.noise = pairs.edge * extent * column(kEdgeNoise) + column(kStartNoise);
    pairs.t_floor = column(kTFloor);
    return pairs;
  }

  // Puts off to decide whether a triangle is hit: most that come first are not the nearest. `limit`: no hit beyond is
  // wanted.
  inline void keep(uint32_t i, const Candidate& candidate, float limit) {
    if (limit < limits_[i]) {
      limits_[i] = limit;
      uint32_t kept = 0;
      for (uint32_t k = 0; k < kept_[i]; ++k) {
        candidates_[i][kept] = candidates_[i][k];
        kept += candidates_[i][k].earliest <= limit ? 1 : 0;
      }
      kept_[i] = kept;
    }
    if (kept_[i] == kMaxCandidates) settle_kept(i);
    candidates_[i][kept_[i]++] = candidate;
  }

  inline void settle_kept(uint32_t i) {
    for (uint32_t k = 0; k < kept_[i]; ++k) {
      const Candidate& candidate = candidates_[i][k];
      if (candidate.earliest <= limits_[i]) settle(*candidate.block, static_cast<int>(candidate.place), i);
    }
    kept_[i] = 0;
  }

  // Decides a pair that float left open. Not of a ray that looks for nothing more: one given up stays so, whatever else
  // of the same block it hits.
  inline void settle(const TriangleBlock& block, int place, uint32_t i) {
    if (limits_[i] < 0 && !planted(PlantedBug::kKernelHitAfterGivingUp)) return;
    const Verdict verdict = decide(block, place, rays_[i], PreparedRay(*prepared_, i));
    if (verdict.what == KernelVerdict::kUndecided) give_up(i);
    if (verdict.what != KernelVerdict::kHit) return;
    take(i, verdict.t, number_of(*tree_, block, place));
  }

  // kAny: nothing more is wanted of the ray.
  inline void find(uint32_t i) {
    hits_[i].verdict = KernelVerdict::kHit;
    limits_[i] = kNever;
  }

  inline void take(uint32_t i, float t, uint32_t number) {
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
  uint32_t front_, back_;  // the rays that accept a triangle seen so
  uint32_t nodes_;
  uint32_t top_;
  alignas(32) float limits_[kTreeWidth];
  uint32_t kept_[kTreeWidth];
  Candidate candidates_[kTreeWidth][kMaxCandidates];
  Waiting waiting_[kTreeStack];
};

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_PACKET_IMPL_H_
