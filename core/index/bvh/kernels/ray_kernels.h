// What the kernels of every instruction set offer: rays against one mesh's tree, many triangles at a time. They decide
// in float where float is certain by a written bound and in double elsewhere, by the very arithmetic of TriangleRay
// (core/geometry/ray_triangle.h), so that their answers are its answers bit for bit; what neither settles is left
// undecided, and the caller asks again, triangle by triangle. Plain data; functions without state, safe from any
// thread; they take 220 KB of stack.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_H_

#include <cstddef>
#include <cstdint>

#include "core/index/bvh/triangle_tree.h"

namespace locus {

// In mesh axes. The largest |component| of the direction lies within kMinKernelDirection .. kMaxKernelDirection and the
// origin is finite; of other rays the kernels may leave out or invent hits.
struct KernelRay {
  double origin[3];
  double direction[3];
  float limit;        // hits up to here, included; in lengths of the direction
  bool accept_front;  // triangles seen counter-clockwise
  bool accept_back;
  // Nothing has turned the ray: components of the direction that are zero are so exactly, and triangles across such an
  // axis exactly edge-on.
  bool unturned = false;
};

inline constexpr double kMinKernelDirection = 0x1p-20;
inline constexpr double kMaxKernelDirection = 0x1p20;
// So must the largest |coordinate| of the origin plus the largest of the mesh within these: elsewhere the products of
// the bounds would vanish or overflow.
inline constexpr double kMinKernelReach = 0x1p-24;
inline constexpr double kMaxKernelReach = 0x1p33;
// A ray that has met this many triangles is left undecided, so that a call ends soon.
inline constexpr uint32_t kMaxKernelTests = 4096;

enum class KernelVerdict : uint8_t { kMiss, kHit, kUndecided };

struct KernelHit {
  float t;          // in lengths of the direction; FIRST only
  uint32_t number;  // FIRST: of the triangle, the lowest of those at t; ALL: how many rows stand
  KernelVerdict verdict;
  uint32_t nodes;  // opened
  uint32_t tests;  // triangles met
};

// One hit of many.
struct KernelRow {
  float t;  // in lengths of the direction
  uint32_t number;
};

struct RayKernels {
  const char* name;  // of the instruction set
  // Nearest hits of `count` rays. Many rays in one call are answered faster than one in each: they are on their way at
  // once. Each answer depends on its own ray alone.
  void (*first)(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count);
  // Whether there is a hit at all.
  void (*any)(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count);
  // The hits of each ray, or the lowest `most` of them, in order of t, then number, where there are that many or more;
  // `most` >= 1. Those of ray i stand from rows[i * most] on, in no order. What an undecided ray leaves there is void.
  void (*all)(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count, KernelRow* rows,
              uint32_t most);
};

// The exported symbol of each instruction set's object. Only to be called on a processor that has it.
const RayKernels& ray_kernels_avx2();
const RayKernels& ray_kernels_sse4();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_KERNELS_H_
