// Region kernels: vector code that finds all triangles of one mesh's tree that overlap a ball or a box. The code tests
// eight boxes or triangles at a time. The kernels of each instruction set are in an object file of their own. A kernel
// accepts the result of a float test only if a documented bound of the rounding error proves that the result is right.
// Otherwise the kernel calls the caller's RegionPredicate, which uses the predicates of
// core/geometry/triangle_overlap.h, so that the answers of kernels equal the answers of the predicates. The triangle
// numbers of a subtree that lies completely inside the region are copied without tests. The kernels are used through
// core/query/kinds/triangle_search.h. Plain data; functions without state, safe from any thread.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_H_

#include <cstddef>
#include <cstdint>

#include "core/index/bvh/triangle_tree.h"

namespace locus {

// Ball in mesh axes. Precondition: all members are finite, and the sum of the largest |coordinate| of its centre, its
// radius and TriangleTree::magnitude is at most kMaxRegionReach.
struct KernelBall {
  float center[3];
  float radius;
};

// Box of any orientation in mesh axes. Precondition: as for KernelBall, with the sum of the half extents as the radius.
struct KernelBox {
  float center[3];
  float half[3];
  float rotation[9];  // rows of the matrix from box axes to mesh axes
  // Axis-aligned box strictly around this box (`outer`), and axis-aligned box strictly within this box (`inner`, valid
  // only if this box is not rotated).
  float outer_min[3], outer_max[3];
  float inner_min[3], inner_max[3];
};

inline constexpr float kMaxRegionReach = 0x1p29f;
// Number of tested triangles after which a call of RegionKernel::one() pauses, so that its caller can check deadlines
// and cancellation.
inline constexpr uint32_t kMaxRegionTests = 4096;
// Minimum of RegionVisit::room: the output array must have room for the triangle numbers of one block.
inline constexpr size_t kMinRegionRoom = 8;
// Maximum number of regions in a call of many().
inline constexpr size_t kMaxRegions = 16;
// Number of unprocessed items (blocks, and subtrees completely inside the region) above which a visit opens no more
// nodes until all items are processed. Opening one node adds up to eight items.
inline constexpr uint32_t kMaxRegionItems = 56;

// Exact predicate for the triangles that the float tests leave undecided. meets() returns whether the triangle in lane
// `lane` of `block` overlaps `region`, which the caller owns.
struct RegionPredicate {
  bool (*meets)(const void* region, const TriangleBlock& block, uint32_t lane);
  const void* region;
};

// Resumable visit of one tree for one region: its state between two calls, and the output of the last call.
struct RegionVisit {
  RegionPredicate predicate;
  uint32_t* numbers;     // output array of the next call; owned by the caller
  size_t room;           // length of `numbers`, at least kMinRegionRoom; a call may overwrite all of it
  size_t found;          // count of triangle numbers written by the last call; successive calls write in storage order
  uint32_t nodes;        // number of nodes opened by the last call
  uint32_t tests;        // number of triangles tested by the last call
  uint32_t exact_tests;  // number of tested triangles for which `predicate` was called
  uint32_t top;          // number of elements in the stack `waiting`
  uint32_t next, end;    // range of unprocessed elements of `items`
  NodeRange rest;        // triangles inside the region, whose numbers are still to be copied to `numbers`
  alignas(32) uint32_t waiting[kTreeStack];  // stack of nodes to open and subtrees inside the region
  alignas(32) uint32_t items[kMaxRegionItems + kTreeWidth];

  // Begins a visit at the root; undecided triangles will be tested by `by`.
  void start(const RegionPredicate& by) {
    predicate = by;
    top = 1;
    next = end = 0;
    rest = {};
    waiting[0] = 0;
  }
  // Returns whether the visit is complete, so that no further call is needed.
  bool over() const { return top == 0 && next == end && rest.count == 0; }
};

// Kernel of one kind of region.
// - one() continues a visit until it is complete, until `numbers` may have no room for the triangle numbers of another
//   block, or until at least kMaxRegionTests triangles were tested.
// - many() answers up to kMaxRegions regions and opens their nodes in turns, so that their memory accesses overlap.
//   many() writes the triangle numbers found for each region to `numbers`, one region after the other, and the count of
//   triangle numbers of each region to `counts`. `room` is the length of `numbers`. Returns the number of answered
//   regions, which is less than `regions` if `room` was too small for the next region.
template <class Region>
struct RegionKernel {
  void (*one)(const TriangleTree&, const Region&, RegionVisit&);
  size_t (*many)(const TriangleTree&, const Region*, const RegionPredicate*, size_t regions, uint32_t* numbers,
                 size_t room, uint32_t* counts);
};

// Kernels of one instruction set.
struct RegionKernels {
  const char* name;  // name of the instruction set
  RegionKernel<KernelBall> ball;
  RegionKernel<KernelBox> box;  // for boxes that are not rotated
  RegionKernel<KernelBox> turned_box;
};

// Return the kernels of one instruction set. Each function is the only symbol that its object file exports.
// Precondition: the processor supports the instruction set.
const RegionKernels& region_kernels_avx2();
const RegionKernels& region_kernels_sse4();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_REGION_KERNELS_H_
