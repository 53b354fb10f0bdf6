// Vector of eight floats for the kernels: a thin wrapper that lets one source serve several instruction sets. The
// functions are documented in floats8_avx2.h; floats8_sse4.h offers the same functions. All functions have internal
// linkage, because each object file is compiled for a different instruction set and the linker must not merge functions
// of different object files.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_

#ifdef __AVX2__
#include "core/index/bvh/kernels/floats8_avx2.h"
#else
#include "core/index/bvh/kernels/floats8_sse4.h"
#endif

namespace locus {
namespace {

// Key of a child slot that was already visited; greater than every other key.
constexpr uint32_t kVisitedKey = 0xFFFFFFFFu;

// Returns the greatest key that a slot at a distance of at most `limit` can have. Precondition: `limit` is finite and
// not negative.
static inline uint32_t greatest_key(float limit) {
  return static_cast<uint32_t>(_mm_cvtsi128_si32(_mm_castps_si128(_mm_set_ss(limit)))) | 7u;
}

// Returns the distance that the key of a slot contains: the slot's distance, rounded down by less than 2^-20 of its
// value.
static inline float distance_of(uint32_t key) {
  return _mm_cvtss_f32(_mm_castsi128_ps(_mm_cvtsi32_si128(static_cast<int>(key & ~7u))));
}

// Prefetches the cache lines of the `bytes` bytes of memory that begin at `from`, which must be a multiple of 64.
static inline void prefetch(const void* from, int bytes) {
  for (int line = 0; line < bytes; line += 64) _mm_prefetch(static_cast<const char*>(from) + line, _MM_HINT_T0);
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_
