// Nearest kernels: vector code that finds the triangles of one mesh's tree that may be nearest to a point. The code
// tests eight boxes or triangles at a time. The kernels of each instruction set are in an object file of their own. A
// kernel computes in float, for each triangle, a lower and an upper bound of its distance, and returns as candidates
// all triangles that these bounds do not exclude. A second function measures the candidates in double, in the
// arithmetic of core/geometry/point_triangle.h, so that the result equals that of a test of all triangles in double.
// The kernels are used by core/query/kinds/nearest_query.cc. Plain data; functions without state, safe from any thread.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_KERNELS_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_KERNELS_H_

#include <cstddef>
#include <cstdint>

#include "core/index/bvh/triangle_tree.h"

namespace locus {

// Upper limit of the sum of a point's largest |coordinate| and TriangleTree::magnitude.
inline constexpr float kMaxNearestReach = 0x1p29f;
// Number of tested triangles after which a call of a kernel pauses, so that its caller can check deadlines and
// cancellation.
inline constexpr uint32_t kMaxNearestTests = 4096;
// Maximum of NearestVisit::room.
inline constexpr uint32_t kMaxCandidates = 64;
// Length of the stack NearestVisit::groups, which has at most one group for each level of a tree. A tree has at most
// limits::kMaxBvhDepth levels.
inline constexpr uint32_t kMaxNearestGroups = 64;

// Triangle that may be nearest: lane `lane` of TriangleTree::blocks[block].
struct NearestCandidate {
  uint32_t block, lane;
  float low;  // lower bound of the distance
};

// Point in mesh axes, the state of a visit of one tree between two calls, and the candidates of the last call.
struct NearestVisit {
  float point[3];  // finite; see kMaxNearestReach
  float pad;       // >= 0: upper bound of the distance between `point` and the caller's unrounded point
  // Maximum distance from the caller's point, in mesh axes, >= 0: triangles beyond the limit are not needed. The caller
  // may lower the limit between two calls; see also `closest`.
  float limit;
  // True if only the nearest triangle is needed. The kernel then lowers `limit` itself, to b * (1 + 2^-19) + `slack`,
  // where b is the least of the upper bounds that it has computed. False if all triangles within `limit` are needed.
  bool closest;
  float slack;     // only with `closest`; >= 0
  uint32_t room;   // a call pauses when it has this many candidates; 1 to kMaxCandidates
  uint32_t found;  // number of candidates of the last call; their `low` is at most `limit`
  uint32_t nodes;  // number of nodes opened by the last call
  uint32_t tests;  // number of triangles tested by the last call
  NearestCandidate candidates[kMaxCandidates + kTreeWidth];
  uint32_t next;  // node to open next; kNoChild: take the nearest child of the top group
  uint32_t top;   // number of elements in the stack `groups`
  // Stack with at most one group per tree level. A group is an opened node with children that are not visited yet.
  // `groups` contains the indices of these nodes. `keys` contains a sort key for each child slot of each node: the key
  // increases with the distance of the child's box, and is kVisitedKey if the child was visited.
  uint32_t groups[kMaxNearestGroups];
  alignas(32) uint32_t keys[kMaxNearestGroups][kTreeWidth];

  // Begins a visit at the root.
  void start() { next = top = 0; }
  // Returns whether the visit is complete, so that no further call is needed.
  bool over() const { return next == kNoChild && top == 0; }
};

// Query's point and the placement of the mesh, in world axes: world = translation + scale * (rotation * mesh).
struct NearestPlacement {
  double point[3];
  double translation[3];
  double rotation[9];  // rows of the matrix
  double scale;
  double epsilon;  // amount by which the bounds of a placed triangle are grown
};

// Kernels of one instruction set.
// - run() continues a visit until it is complete, `room` candidates were found, or at least kMaxNearestTests triangles
//   were tested. Over all calls for one visit, each triangle within the final `limit` becomes a candidate exactly once.
// - measure() writes the squared distance of each candidate from the point, in world axes and in double: the value of
//   squared_distance() in core/geometry/point_triangle.h or, if greater, the squared distance to the triangle's bounds.
//   The results equal those of the scalar functions, bit for bit.
struct NearestKernels {
  const char* name;  // name of the instruction set
  void (*run)(const TriangleTree&, NearestVisit&);
  void (*measure)(const TriangleTree&, const NearestPlacement&, const NearestCandidate*, uint32_t count,
                  double* squared);
};

// Return the kernels of one instruction set. Each function is the only symbol that its object file exports.
// Precondition: the processor supports the instruction set.
const NearestKernels& nearest_kernels_avx2();
const NearestKernels& nearest_kernels_sse4();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_NEAREST_KERNELS_H_
