// Vector of eight floats for the kernels: a thin wrapper that lets one source serve several instruction sets. The
// functions are documented in floats8_avx2.h; floats8_sse4.h offers the same functions. All functions have internal
// linkage, because each object file is compiled for another instruction set and the linker must not merge functions of
// different object files.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_

#ifdef __AVX2__
#include "core/index/bvh/kernels/floats8_avx2.h"
#else
#include "core/index/bvh/kernels/floats8_sse4.h"
#endif

namespace locus {
namespace {

// Prefetches the cache lines of the `bytes` bytes of memory that begin at `from`.
static inline void prefetch(const void* from, int bytes) {
  for (int line = 0; line < bytes; line += 64) _mm_prefetch(static_cast<const char*>(from) + line, _MM_HINT_T0);
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_
