// Crossing kernels: vector code that sums the signed crossings of a half line, which is parallel to an axis, with the
// triangles of one mesh's tree. The code tests eight boxes or triangles at a time. The sum is the winding number of a
// closed mesh around the start of the half line: see core/geometry/point_in_mesh.h. A kernel accepts the sign of a
// value computed in float only if a documented bound of the rounding error proves that the sign is right. Otherwise,
// and for triangles on which the start of the half line may lie, the kernel calls the caller's CrossingPredicate, so
// that the answers equal those of crossing(). The kernels are used through core/query/kinds/winding_search.h. Plain
// data; functions without state, safe from any thread.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_CROSSING_KERNELS_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_CROSSING_KERNELS_H_

#include <cstdint>

#include "core/index/bvh/half_line_floats.h"
#include "core/index/bvh/triangle_tree.h"

namespace locus {

// Number of opened nodes and tested triangles after which a call of a kernel pauses, so that its caller can check
// deadlines and cancellation.
inline constexpr uint32_t kMaxCrossingWork = 4096;
// Result of CrossingPredicate::crossing() if the start of the half line lies on the triangle.
inline constexpr int kOnTriangle = 2;

// Exact predicate for the triangles that the float tests leave undecided. crossing() returns Crossing::winding for the
// triangle in lane `lane` of `block`, or kOnTriangle. The caller owns `context`.
struct CrossingPredicate {
  int (*crossing)(const void* context, const TriangleBlock& block, uint32_t lane);
  const void* context;
};

// Resumable visit of one tree for one half line: its state between two calls, and the output.
struct CrossingVisit {
  HalfLineFloats line;
  CrossingPredicate predicate;
  int64_t winding;       // sum of the crossings of all calls
  bool on_surface;       // the start of the half line lies on a triangle; this ends the visit
  uint32_t nodes;        // number of nodes opened by the last call
  uint32_t tests;        // number of triangles tested by the last call: those whose bounds the half line meets
  uint32_t exact_tests;  // number of tested triangles for which `predicate` was called
  uint32_t top;          // number of elements in the stack `waiting`
  alignas(32) uint32_t waiting[kTreeStack];  // stack of nodes to open

  // Begins a visit at the root; `line` and `predicate` are set by the caller.
  void start() {
    winding = 0;
    on_surface = false;
    top = 1;
    waiting[0] = 0;
  }
  // Returns whether the visit is complete, so that no further call is needed.
  bool over() const { return top == 0; }
};

// Kernels of one instruction set. run() continues a visit until it is complete, or until the number of opened nodes
// plus the number of tested triangles is at least kMaxCrossingWork. It opens the same nodes, and tests the same
// triangles, in the same order as TriangleBvh::visit_half_line().
struct CrossingKernels {
  const char* name;  // name of the instruction set
  void (*run)(const TriangleTree&, CrossingVisit&);
};

// Return the kernels of one instruction set. Each function is the only symbol that its object file exports.
// Precondition: the processor supports the instruction set.
const CrossingKernels& crossing_kernels_avx2();
const CrossingKernels& crossing_kernels_sse4();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_CROSSING_KERNELS_H_
