// Eight floats at once, for the kernels: the thinnest wrapper that lets one source serve several instruction sets. What
// each function does stands in floats8_avx2.h; the others offer the same. Everything has internal linkage, since each
// object is compiled for a processor that the next may not be.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_

#ifdef __AVX2__
#include "core/index/bvh/kernels/floats8_avx2.h"
#else
#include "core/index/bvh/kernels/floats8_sse4.h"
#endif

namespace locus {
namespace {

// Asks for the memory of a child before it is needed.
static inline void prefetch(const void* from, int bytes) {
  for (int line = 0; line < bytes; line += 64) _mm_prefetch(static_cast<const char*>(from) + line, _MM_HINT_T0);
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_
