// Traversal of the nearest kernels, compiled once for each instruction set by the .cc file that includes it. The
// traversal is depth first and visits the child with the nearest box first. The children of an opened node form a
// group. They are taken from the group in order of distance, until the nearest remaining child is beyond the limit.
// nearest_block_impl.h contains the bounds of the distances to triangles.
//
// Errors of squared distances to boxes, with u = 2^-24: the differences add 2 u of the value, the square u and the two
// sums 2 u, 5 u in all; squares that underflow add at most 2^-148. A key rounds the squared distance down, which only
// makes a box nearer. The limit is raised by 2^-20 = 16 u once before and once after it is squared, which covers the 5
// u and the roundings of the limit itself; a squared limit below 2^-100 is raised to 2^-100, so that 2^-148 is less
// than u of it. The distance of a block is computed from its key and is too small by at most 2^-20 of its value plus
// 2^-73. The error bound of the block is 32 u L + 2^-59, but only 18 u L + 2^-85 are needed: the difference covers the
// error of the distance and the roundings of the bound itself.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_KERNELS_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_KERNELS_IMPL_H_

#include "core/index/bvh/kernels/nearest_block_impl.h"

namespace locus {
namespace {

static_assert(kTreeWidth == 8, "a key holds a slot in three bits");

// Returns the error bound `bound`, or 0 if `bug` is planted. A test plants the bug to show that the bound is needed.
static inline float unless(PlantedBug bug, float bound) { return planted(bug) ? 0 : bound; }

// State of one call of NearestKernels::run().
class NearestWalk {
 public:
  inline NearestWalk(const TriangleTree& tree, NearestVisit& visit)
      : tree_(tree),
        visit_(visit),
        point_(Vector8::splat(visit.point)),
        pad_(unless(PlantedBug::kNearestPad, visit.pad)),
        limit_(visit.limit),
        top_(visit.top) {
    set_limit(limit_);
  }

  inline void run() {
    Child now = {visit_.next, 0};
    visit_.next = kNoChild;
    for (;;) {
      if (now.child == kNoChild && (now = next()).child == kNoChild) break;
      while ((now.child & kBlockBit) == 0) now = open(now.child);
      if (now.child == kNoChild) continue;
      test(now.child & ~kBlockBit, now.near);
      now.child = kNoChild;
      if (tests_ >= kMaxNearestTests) break;
      if (found_ < visit_.room) continue;
      drop_far();
      if (found_ >= visit_.room) break;
    }
    drop_far();
    visit_.limit = limit_;
    visit_.found = found_;
    visit_.nodes = nodes_;
    visit_.tests = tests_;
    visit_.top = top_;
  }

 private:
  // Sets the limit of distances, and `limit_key_`: the greatest key of a box within the limit. The keys of boxes
  // contain squared distances from the rounded point.
  inline void set_limit(float limit) {
    constexpr float kMin = 0x1p-100f, kMax = 0x1p125f;  // kMax is less than the squared distance of an unused slot
    const float raise = 1 + unless(PlantedBug::kNearestBoxLimit, 0x1p-20f);
    limit_ = limit;
    const float raised = (limit + pad_) * raise;
    float squared = raised * raised * raise;
    if (squared < unless(PlantedBug::kNearestFloor, kMin)) squared = kMin;
    if (!(squared < kMax)) squared = kMax;
    limit_key_ = greatest_key(squared);
  }

  struct Child {
    uint32_t child;
    float near;  // lower bound of the squared distance of the child's box
  };

  // Takes the nearest child of the top group, whose keys are `keys`. If this child is beyond the limit, drops the group
  // and returns kNoChild.
  __attribute__((always_inline)) inline Child take(Keys8 keys) {
    const uint32_t key = least_key(keys);
    if (key > limit_key_) {
      --top_;
      return {kNoChild, 0};
    }
    const uint32_t slot = key % kTreeWidth;
    const Keys8 rest = without(keys, key);
    rest.store(visit_.keys[top_ - 1]);
    if (const uint32_t then = least_key(rest); then <= limit_key_)
      prefetch_child(tree_.nodes[visit_.groups[top_ - 1]].child[then % kTreeWidth]);
    return {tree_.nodes[visit_.groups[top_ - 1]].child[slot], distance_of(key)};
  }

  // Returns the next child within the limit, or kNoChild if there is none.
  inline Child next() {
    while (top_ != 0) {
      const Child child = take(Keys8::load(visit_.keys[top_ - 1]));
      if (child.child != kNoChild) return child;
    }
    return {kNoChild, 0};
  }

  // Opens a node and returns its nearest child, or kNoChild if that child is beyond the limit.
  __attribute__((always_inline)) inline Child open(uint32_t index) {
    ++nodes_;
    const TriangleNode& node = tree_.nodes[index];
    const Vector8 below = Vector8::load(node.bounds) - point_, above = point_ - Vector8::load(node.bounds + 3);
    const Floats8 zero = Floats8::splat(0);
    const Vector8 gap = {maximum(maximum(below.x, above.x), zero), maximum(maximum(below.y, above.y), zero),
                         maximum(maximum(below.z, above.z), zero)};
    const Keys8 keys = keys_of(dot(gap, gap));
    visit_.groups[top_++] = index;
    return take(keys);
  }

  // Tests the triangles of a block, whose box has the squared distance `near`.
  __attribute__((always_inline)) inline void test(uint32_t index, float near) {
    const TriangleBlock& block = tree_.blocks[index];
    tests_ += block.count;
    const Bounds8 bounds = distance_bounds(point_, block);
    const float error = unless(PlantedBug::kNearestError, 0x1p-19f * (root(near) + 2 * block.extent)) + pad_ +
                        unless(PlantedBug::kNearestFloor, 0x1p-59f);
    uint32_t within = at_most(bounds.low, Floats8::splat(limit_ + error)) & ((1u << block.count) - 1u);
    if (within == 0) return;
    if (visit_.closest) {
      const float limit =
          (least(bounds.high) + error) * (1 + 0x1p-19f) + unless(PlantedBug::kNearestSlack, visit_.slack);
      if (limit < limit_) set_limit(limit);
      within &= at_most(bounds.low, Floats8::splat(limit_ + error));
      if (planted(PlantedBug::kNearestOtherLane)) within &= within - 1u;
    }
    alignas(32) float lows[kTreeWidth];
    bounds.low.store(lows);
    for (; within != 0; within &= within - 1u) {
      const auto lane = static_cast<uint32_t>(__builtin_ctz(within));
      visit_.candidates[found_++] = {index, lane, lows[lane] - error};
    }
  }

  // Drops the candidates beyond the limit.
  inline void drop_far() {
    uint32_t kept = 0;
    for (uint32_t i = 0; i < found_; ++i) {
      visit_.candidates[kept] = visit_.candidates[i];
      kept += static_cast<uint32_t>(visit_.candidates[i].low <= limit_);
    }
    found_ = kept;
  }

  inline void prefetch_child(uint32_t child) const {
    if ((child & kBlockBit) != 0)
      prefetch(&tree_.blocks[child & ~kBlockBit], sizeof(TriangleBlock));
    else
      prefetch(&tree_.nodes[child], sizeof(TriangleNode));
  }
  static inline float root(float a) { return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(a))); }

  const TriangleTree& tree_;
  NearestVisit& visit_;
  const Vector8 point_;
  const float pad_;
  float limit_;
  uint32_t limit_key_ = 0;
  uint32_t top_, found_ = 0, nodes_ = 0, tests_ = 0;
};

static void find_nearest(const TriangleTree& tree, NearestVisit& visit) { NearestWalk(tree, visit).run(); }

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_KERNELS_IMPL_H_
