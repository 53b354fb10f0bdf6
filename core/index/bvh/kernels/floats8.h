// Eight floats at once, for the kernels: the thinnest wrapper that lets one source serve several instruction sets.
// Everything has internal linkage, since each object is compiled for a processor that the next may not be.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_

#include <immintrin.h>

#include <cstdint>

#include "core/index/bvh/triangle_tree.h"

namespace locus {
namespace {

struct Floats8 {
  __m256 v;

  static inline Floats8 all(float value) { return {_mm256_set1_ps(value)}; }
  static inline Floats8 load(const float* from) { return {_mm256_load_ps(from)}; }
  inline void store(float* to) const { _mm256_storeu_ps(to, v); }

  friend inline Floats8 operator+(Floats8 a, Floats8 b) { return {_mm256_add_ps(a.v, b.v)}; }
  friend inline Floats8 operator-(Floats8 a, Floats8 b) { return {_mm256_sub_ps(a.v, b.v)}; }
  friend inline Floats8 operator*(Floats8 a, Floats8 b) { return {_mm256_mul_ps(a.v, b.v)}; }
  friend inline Floats8 operator/(Floats8 a, Floats8 b) { return {_mm256_div_ps(a.v, b.v)}; }
};

static inline Floats8 multiply_add(Floats8 a, Floats8 b, Floats8 c) { return {_mm256_fmadd_ps(a.v, b.v, c.v)}; }
static inline Floats8 multiply_subtract(Floats8 a, Floats8 b, Floats8 c) { return {_mm256_fmsub_ps(a.v, b.v, c.v)}; }
static inline Floats8 subtract_product(Floats8 c, Floats8 a, Floats8 b) { return {_mm256_fnmadd_ps(a.v, b.v, c.v)}; }
static inline Floats8 smaller(Floats8 a, Floats8 b) { return {_mm256_min_ps(a.v, b.v)}; }
static inline Floats8 larger(Floats8 a, Floats8 b) { return {_mm256_max_ps(a.v, b.v)}; }
static inline Floats8 size_of(Floats8 a) { return {_mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.v)}; }

// One bit a lane. False for NaN.
static inline uint32_t at_most(Floats8 a, Floats8 b) {
#ifdef __AVX512VL__
  return _mm256_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ);
#else
  return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)));
#endif
}
static inline uint32_t below(Floats8 a, Floats8 b) {
#ifdef __AVX512VL__
  return _mm256_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ);
#else
  return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)));
#endif
}

#ifndef __AVX512VL__
// For each set of lanes their numbers, packed to the front. Made by the compiler.
struct PackTable {
  alignas(64) uint8_t lanes[256][8];
  constexpr PackTable() : lanes() {
    for (int set = 0; set < 256; ++set) {
      int count = 0;
      for (int lane = 0; lane < 8; ++lane)
        if ((set >> lane & 1) != 0) lanes[set][count++] = static_cast<uint8_t>(lane);
    }
  }
};
static constexpr PackTable kPack;

static inline __m256i packing(uint32_t set) {
  return _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kPack.lanes[set])));
}
#endif

// Writes the children whose bits are set, in the order of their slots; eight places are written.
static inline void pack_children(const TriangleNode& node, uint32_t set, uint32_t* children) {
  const __m256i all = _mm256_load_si256(reinterpret_cast<const __m256i*>(node.child));
#ifdef __AVX512VL__
  const __m256i packed = _mm256_maskz_compress_epi32(static_cast<__mmask8>(set), all);
#else
  const __m256i packed = _mm256_permutevar8x32_epi32(all, packing(set));
#endif
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children), packed);
}

// Writes the children whose bits are set and how near they are, from far to near for that octant of directions.
static inline void pack_sorted(const TriangleNode& node, uint32_t set, Floats8 near, uint32_t octant,
                               uint32_t* children, float* nears) {
  const __m256i shifts = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
  const __m256i order = _mm256_srlv_epi32(_mm256_set1_epi32(static_cast<int>(node.order[octant])), shifts);
  const __m256i child =
      _mm256_permutevar8x32_epi32(_mm256_load_si256(reinterpret_cast<const __m256i*>(node.child)), order);
  const __m256 sorted = _mm256_permutevar8x32_ps(near.v, order);
  const __m256i slot = _mm256_and_si256(order, _mm256_set1_epi32(7));
  const __m256i bits = _mm256_slli_epi32(_mm256_srlv_epi32(_mm256_set1_epi32(static_cast<int>(set)), slot), 31);
#ifdef __AVX512VL__
  const __mmask8 chosen = _mm256_movepi32_mask(bits);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children), _mm256_maskz_compress_epi32(chosen, child));
  _mm256_storeu_ps(nears, _mm256_maskz_compress_ps(chosen, sorted));
#else
  const __m256i packed = packing(static_cast<uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(bits))));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children), _mm256_permutevar8x32_epi32(child, packed));
  _mm256_storeu_ps(nears, _mm256_permutevar8x32_ps(sorted, packed));
#endif
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_H_
