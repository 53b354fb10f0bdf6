// What the kernels of every instruction set offer: all triangles of one mesh's tree that a ball or a box meets, eight
// boxes or triangles at a time. They decide in float where float is certain by a written bound, and ask the caller's
// judge, the predicates of core/geometry/triangle_overlap.h, for the rest, so that their answers are its answers bit
// for bit. A subtree that lies wholly inside is emitted as it stands. core/query/kinds/triangle_search.h is the way to
// use them. Plain data; functions without state, safe from any thread.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_H_

#include <cstddef>
#include <cstdint>

#include "core/index/bvh/triangle_tree.h"

namespace locus {

// In mesh axes, like every region here. Finite, and the largest |coordinate| of the centre, plus the radius, plus the
// tree's magnitude, at most kMaxRegionReach.
struct KernelBall {
  float center[3];
  float radius;
};

// A box of any orientation. The same limit holds, with the sum of its half extents for the radius.
struct KernelBox {
  float center[3];
  float half[3];
  float rotation[9];  // rows of the matrix from box axes
  // Around all that the box reaches in mesh axes, strictly; and, where it is not turned, strictly within it.
  float outer_min[3], outer_max[3];
  float inner_min[3], inner_max[3];
};

inline constexpr float kMaxRegionReach = 0x1p29f;
// A call ends after so many triangles, for its caller to see whether to go on.
inline constexpr uint32_t kMaxRegionTests = 4096;
// The least room for numbers that a call works with.
inline constexpr size_t kMinRegionRoom = 8;
// Regions that a call for many takes.
inline constexpr size_t kMaxRegions = 16;
// Blocks and subtrees that a visit may have found, but not yet looked into; eight more may be written behind the last.
inline constexpr uint32_t kMaxRegionItems = 56;

// Decides what float leaves open.
struct RegionJudge {
  bool (*meets)(const void* region, const TriangleBlock& block, uint32_t place);
  const void* region;
};

// A visit of one tree for one region: where it stands between two calls, and where its numbers go.
struct RegionVisit {
  RegionJudge judge;
  uint32_t* numbers;                         // where the next call writes to
  size_t room;                               // and how far: at least kMinRegionRoom; all of it may be written to
  size_t found;                              // by the last call: in storage order, behind those of the calls before
  uint32_t nodes;                            // opened by the last call
  uint32_t tests;                            // triangles met by the last call
  uint32_t judged;                           // of these, by the judge
  uint32_t top;                              // of `waiting`
  uint32_t next, end;                        // of `items`
  NodeRange rest;                            // of a subtree that is found, but not yet written
  alignas(32) uint32_t waiting[kTreeStack];  // nodes
  alignas(32) uint32_t items[kMaxRegionItems + kTreeWidth];

  void start(const RegionJudge& by) {
    judge = by;
    top = 1;
    next = end = 0;
    rest = {};
    waiting[0] = 0;
  }
  bool over() const { return top == 0 && next == end && rest.count == 0; }
};

// One goes on with a visit, which pauses when it is over, when it has no room left, or after kMaxRegionTests tests.
// Many answers up to kMaxRegions regions, whose nodes it opens in turns, so that they wait for memory together: the
// numbers of each behind those of the one before, and how many there are. It returns how many regions are answered:
// all, unless there was no room for more.
template <class Region>
struct RegionKernel {
  void (*one)(const TriangleTree&, const Region&, RegionVisit&);
  size_t (*many)(const TriangleTree&, const Region*, const RegionJudge*, size_t regions, uint32_t* numbers, size_t room,
                 uint32_t* counts);
};

struct RegionKernels {
  const char* name;  // of the instruction set
  RegionKernel<KernelBall> ball;
  RegionKernel<KernelBox> box;  // not turned
  RegionKernel<KernelBox> turned_box;
};

// The exported symbol of the instruction set's object. Only to be called on a processor that has it.
const RegionKernels& region_kernels_avx2();
const RegionKernels& region_kernels_sse4();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_H_
