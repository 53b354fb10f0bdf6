// Ray kernels: vector code that intersects many rays with the tree of one mesh. The kernels of each instruction set are
// in an object file of their own. A kernel accepts the result of a float test only if a documented bound of the
// rounding error proves that the result is right. Otherwise the kernel repeats the test in double by the arithmetic of
// TriangleRay (core/geometry/ray_triangle.h), so that its answers equal the answers of TriangleRay bit for bit. If
// double is not precise enough either, the verdict on the ray is kUndecided, and the caller traces the ray again,
// triangle by triangle with TriangleRay. Plain data; functions without state, safe from any thread; a call uses 300 KB
// of stack.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_H_

#include <cstddef>
#include <cstdint>

#include "core/index/bvh/triangle_tree.h"

namespace locus {

// Value of KernelRay::hint without a hint.
inline constexpr uint32_t kNoBlock = 0xFFFFFFFFu;

// Ray in mesh axes. Precondition: the origin is finite, and the largest |component| of the direction is within
// kMinKernelDirection .. kMaxKernelDirection; otherwise the kernels may miss hits or report hits that do not exist.
struct KernelRay {
  double origin[3];
  double direction[3];
  float limit;        // maximum t of a hit, inclusive, in units of `direction`
  bool accept_front;  // whether to report triangles seen counter-clockwise
  bool accept_back;   // whether to report triangles seen clockwise
  // True if the transform to mesh axes had no rotation. A zero component of the direction is then exact, so a triangle
  // perpendicular to the axis of this component is exactly edge-on.
  bool unrotated = false;
  // any() only: index of a block that is tested first, because it probably has a triangle that the ray hits; or
  // kNoBlock. Whether the ray hits a triangle does not depend on the hint.
  uint32_t hint = kNoBlock;
};

inline constexpr double kMinKernelDirection = 0x1p-20;
inline constexpr double kMaxKernelDirection = 0x1p20;
// Limits of the sum of the largest |coordinate| of the origin and the largest |coordinate| of the mesh. Outside these
// limits, products in the error bounds would underflow or overflow.
inline constexpr double kMinKernelReach = 0x1p-24;
inline constexpr double kMaxKernelReach = 0x1p33;
// Maximum number of triangles with which a ray is tested; with more triangles its verdict is kUndecided. Bounds the
// time of a call.
inline constexpr uint32_t kMaxKernelTests = 4096;

enum class KernelVerdict : uint8_t { kMiss, kHit, kUndecided };

// Answer to one ray.
struct KernelHit {
  float t;  // in units of the ray's direction; valid for first() only
  // first(): lowest number of the triangles hit at t; all(): number of rows written; any(): index of the block with a
  // triangle that the ray hits.
  uint32_t number;
  KernelVerdict verdict;
  // Number of nodes opened, and of triangles tested. What rays traced together share is counted for the first of them.
  uint32_t nodes, tests;
};

// One of the hits found by all().
struct KernelRow {
  float t;          // in units of the ray's direction
  uint32_t number;  // triangle number
};

// Kernels of one instruction set.
struct RayKernels {
  const char* name;  // name of the instruction set
  // Finds the nearest hit of each of `count` rays. One call with many rays is faster than many calls, because the rays
  // are traced interleaved. Each answer depends only on its own ray.
  void (*first)(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count);
  // Determines for each of `count` rays whether it hits a triangle.
  void (*any)(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count);
  // Finds all hits of each ray or, if a ray has more than `max_rows` hits, its lowest `max_rows` hits by (t, triangle
  // number). Precondition: `max_rows` >= 1. The rows of ray i begin at rows[i * max_rows] and are not sorted. The rows
  // of an undecided ray are undefined.
  void (*all)(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count, KernelRow* rows,
              uint32_t max_rows);
};

// Return the kernels of one instruction set. Each function is the only symbol that its object file exports.
// Precondition: the processor supports the instruction set.
const RayKernels& ray_kernels_avx2();
const RayKernels& ray_kernels_sse4();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_H_
