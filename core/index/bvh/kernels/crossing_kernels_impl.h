// Traversal of the crossing kernels, compiled once for each instruction set by the .cc file that includes it. A
// traversal first opens nodes and collects the blocks that the half line meets. Then it tests the blocks one by one.
// The two phases alternate, so that mispredicted branches of one phase do not delay the other. The comparisons of
// coordinates are exact: see half_line_floats.h. Only areas have rounding errors; the bound is derived here.
//
// Let u and v be the ends of an edge, projected along the half line, and relative to p, the start of the half line. The
// sign of the area u.y v.z - u.z v.y shows on which side of the edge p lies. Error of an area, with e = 2^-24: the
// bounds of the triangle contain p, so |u.y|, |u.z|, |v.y| and |v.z| are at most E, the extent of the block. The
// rounded point differs from p by at most `pad` on each axis, so the error of a difference is at most n = pad + e (E +
// pad). The errors of the differences change the two products by 4 E n + 2 n^2 in total; the roundings of the two
// products and of their difference add 4 e (E + n)^2. The sum is below 9 e (E + pad)^2 + 5 pad (E + pad). Products that
// underflow add at most 2^-147. The bound is 16 e (E + pad)^2 + 16 pad (E + pad) + 2^-120, which covers the roundings
// of the bound itself too. The bound is infinite if a product may overflow, so that no sign counts as certain.
//
// Call the coordinate y of a point its height. An edge crosses the height of p if one of its ends is at the height of
// p or below, and its other end is above. Either one rising and one falling edge of a triangle cross this height, or
// no edge crosses it. If two edges cross it and the signs of both areas are certain, the triangle's winding in the
// projection is known. If this winding is 0, p is off the triangle, because the two edges bound the triangle's section
// at this height. If the winding is not 0, p may be on the triangle. If no edge crosses the height, the winding is 0,
// but p may be at the height of the triangle's highest vertex and on the triangle. In these two doubtful cases, p can
// be on the triangle only if the bounds of the triangle extend back to p along the half line.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_CROSSING_KERNELS_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_CROSSING_KERNELS_IMPL_H_

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/crossing_kernels.h"
#include "core/index/bvh/kernels/floats8.h"

namespace locus {
namespace {

// Returns the error bound `bound`, or 0 if `bug` is planted. A test plants the bug to show that the bound is needed.
static inline float unless(PlantedBug bug, float bound) { return planted(bug) ? 0 : bound; }

static inline uint32_t count_of(uint32_t lanes) { return static_cast<uint32_t>(__builtin_popcount(lanes)); }

// One coordinate of the three vertices of eight triangles.
struct Coordinates8 {
  Floats8 a, b, c;

  static inline Coordinates8 load(const TriangleBlock& block, int axis) {
    return {Floats8::load(block.vertices[axis]), Floats8::load(block.vertices[axis + 3]),
            Floats8::load(block.vertices[axis + 6])};
  }
  inline Floats8 least() const { return minimum(minimum(a, b), c); }
  inline Floats8 greatest() const { return maximum(maximum(a, b), c); }
  friend inline Coordinates8 operator-(Coordinates8 v, Floats8 from) { return {v.a - from, v.b - from, v.c - from}; }
  friend inline Coordinates8 operator*(Coordinates8 v, Floats8 by) { return {v.a * by, v.b * by, v.c * by}; }
};

// Masks of eight triangles, about their edges that cross the height of the point. The bit of a triangle is set in `up`
// if the point is to the left of the rising edge, in `down` if the point is to the right of the falling edge, and in
// `doubtful` if the sign of at least one of the two edges is not certain.
struct Edges {
  uint32_t up = 0, down = 0, doubtful = 0;

  // Adds the edge from u to v. `low_u` and `low_v` are the masks of the triangles in which u or v, respectively, is not
  // above the point.
  __attribute__((always_inline)) inline void add(uint32_t low_u, uint32_t low_v, Floats8 area, float error) {
    const uint32_t left = below(Floats8::splat(error), area), right = below(area, Floats8::splat(-error));
    up |= low_u & ~low_v & left;
    down |= low_v & ~low_u & right;
    doubtful |= (low_u ^ low_v) & ~(left | right);
  }
};

// State of one call of CrossingKernels::run().
class CrossingWalk {
 public:
  inline CrossingWalk(const TriangleTree& tree, CrossingVisit& visit)
      : tree_(tree),
        visit_(visit),
        line_(visit.line),
        first_((line_.axis + 1) % 3),
        second_((line_.axis + 2) % 3),
        way_(Floats8::splat(line_.way)),
        along_high_(Floats8::splat(line_.along_high)),
        along_end_(Floats8::splat(line_.along_end)),
        low_{Floats8::splat(line_.low[0]), Floats8::splat(line_.low[1])},
        high_{Floats8::splat(line_.high[0]), Floats8::splat(line_.high[1])},
        top_(visit.top) {}

  inline void run() {
    bool more = true;
    while (more && top_ != 0 && nodes_ + tests_ < kMaxCrossingWork) {
      open_nodes();
      for (uint32_t i = 0; i < found_ && more; ++i) more = test(tree_.blocks[blocks_[i] & ~kBlockBit]);
    }
    visit_.winding += line_.way < 0 ? -winding_ : winding_;
    visit_.on_surface = !more;
    visit_.top = more ? top_ : 0;
    visit_.nodes = nodes_;
    visit_.tests = tests_;
    visit_.exact_tests = exact_tests_;
  }

 private:
  // Opens nodes until none is waiting, or there is no room for the blocks of another node.
  __attribute__((always_inline)) inline void open_nodes() {
    const int begins = line_.way > 0 ? line_.axis : line_.axis + 3, ends = (begins + 3) % 6;
    for (found_ = 0; top_ != 0 && found_ <= kMaxLineBlocks - kTreeWidth;) {
      const TriangleNode& node = tree_.nodes[visit_.waiting[--top_]];
      ++nodes_;
      const Floats8 across = bit_and(bit_and(greater_equal_mask(low_[0], Floats8::load(node.bounds[first_])),
                                             greater_equal_mask(Floats8::load(node.bounds[first_ + 3]), high_[0])),
                                     bit_and(greater_equal_mask(low_[1], Floats8::load(node.bounds[second_])),
                                             greater_equal_mask(Floats8::load(node.bounds[second_ + 3]), high_[1])));
      const Floats8 along = bit_and(greater_equal_mask(Floats8::load(node.bounds[ends]) * way_, along_high_),
                                    greater_equal_mask(along_end_, Floats8::load(node.bounds[begins]) * way_));
      const uint32_t met = signs_of(bit_and(across, along)), met_blocks = met & block_slots(node);
      const uint32_t met_nodes = met & ~met_blocks;
      pack_falling(node, met_blocks, 0, 0, blocks_ + found_);
      pack_falling(node, met_nodes, 0, 0, visit_.waiting + top_);
      found_ += count_of(met_blocks);
      top_ += count_of(met_nodes);
    }
  }

  // Adds the crossings of the triangles of a block. Returns false if the point lies on one of them.
  __attribute__((always_inline)) inline bool test(const TriangleBlock& block) {
    const Coordinates8 first = Coordinates8::load(block, first_), second = Coordinates8::load(block, second_);
    const Coordinates8 along = Coordinates8::load(block, line_.axis) * way_;
    const uint32_t low_a = at_most(first.a, low_[0]), low_b = at_most(first.b, low_[0]),
                   low_c = at_most(first.c, low_[0]);
    const Floats8 begin = along.least();
    const Floats8 reached =
        bit_and(greater_equal_mask(along.greatest(), along_high_), greater_equal_mask(along_end_, begin));
    const Floats8 within =
        bit_and(bit_and(greater_equal_mask(first.greatest(), high_[0]), reached),
                bit_and(greater_equal_mask(low_[1], second.least()), greater_equal_mask(second.greatest(), high_[1])));
    const uint32_t lanes = (1u << block.count) - 1u, met = signs_of(within) & (low_a | low_b | low_c) & lanes;
    if (met == 0) return true;
    const float pad = unless(PlantedBug::kCrossingPad, line_.pad), reach = 2 * (block.extent + pad);
    const float error = unless(PlantedBug::kCrossingError, 0x1p-22f * (reach * reach)) + 8 * pad * reach + 0x1p-120f;
    const Coordinates8 y = first - Floats8::splat(line_.rounded[0]), z = second - Floats8::splat(line_.rounded[1]);
    Edges edges;
    edges.add(low_a, low_b, multiply_subtract(y.a, z.b, z.a * y.b), error);
    edges.add(low_b, low_c, multiply_subtract(y.b, z.c, z.b * y.c), error);
    edges.add(low_c, low_a, multiply_subtract(y.c, z.a, z.c * y.a), error);
    uint32_t near = at_most(begin, Floats8::splat(line_.along_low));
    if (planted(PlantedBug::kCrossingNear)) near = 0;
    const uint32_t crossing = edges.up ^ edges.down, without_edges = ~((low_a ^ low_b) | (low_b ^ low_c));
    const uint32_t maybe_on = planted(PlantedBug::kCrossingTop) ? crossing : crossing | without_edges;
    const uint32_t undecided = met & (edges.doubtful | (near & maybe_on)), decided = met & ~undecided;
    winding_ += static_cast<int64_t>(count_of(edges.up & decided)) - count_of(edges.down & decided);
    if (__builtin_expect(undecided != 0, 0)) return decide(block, met, undecided);
    tests_ += count_of(met);
    return true;
  }

  // Adds the exact crossings of the triangles in the mask `undecided`, and counts the triangles in the mask `met` as
  // tested. Returns false if the point lies on a triangle.
  inline bool decide(const TriangleBlock& block, uint32_t met, uint32_t undecided) {
    for (; undecided != 0; undecided &= undecided - 1u) {
      const auto lane = static_cast<uint32_t>(__builtin_ctz(undecided));
      ++exact_tests_;
      const int found = visit_.predicate.crossing(visit_.predicate.context, block, lane);
      if (found == kOnTriangle) {
        tests_ += count_of(met & ((2u << lane) - 1u));
        return false;
      }
      visit_.winding += found;
    }
    tests_ += count_of(met);
    return true;
  }

  const TriangleTree& tree_;
  CrossingVisit& visit_;
  const HalfLineFloats line_;
  const int first_, second_;  // the two axes perpendicular to the half line
  const Floats8 way_, along_high_, along_end_, low_[2], high_[2];
  uint32_t top_, found_ = 0, nodes_ = 0, tests_ = 0, exact_tests_ = 0;
  int64_t winding_ = 0;                          // sum of decided crossings, with the signs for an ascending half line
  alignas(32) uint32_t blocks_[kMaxLineBlocks];  // blocks still to be tested: `found_` elements
};

static void sum_crossings(const TriangleTree& tree, CrossingVisit& visit) { CrossingWalk(tree, visit).run(); }

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_CROSSING_KERNELS_IMPL_H_
