// Vector of eight floats in two SSE registers (SSE 4.2, x86-64-v2): see floats8.h; the functions are documented in
// floats8_avx2.h. Products are not fused with sums: the error bounds of the kernels include the additional rounding.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_SSE4_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_SSE4_H_

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "core/index/bvh/triangle_tree.h"

namespace locus {
namespace {

struct Floats8 {
  __m128 low, high;

  static inline Floats8 both_halves(__m128 half) { return {half, half}; }
  static inline Floats8 splat(float value) { return both_halves(_mm_set1_ps(value)); }
  static inline Floats8 load(const float* from) { return {_mm_load_ps(from), _mm_load_ps(from + 4)}; }
  static inline Floats8 load_unaligned(const float* from) { return {_mm_loadu_ps(from), _mm_loadu_ps(from + 4)}; }
  inline void store(float* to) const {
    _mm_storeu_ps(to, low);
    _mm_storeu_ps(to + 4, high);
  }

  friend inline Floats8 operator+(Floats8 a, Floats8 b) {
    return {_mm_add_ps(a.low, b.low), _mm_add_ps(a.high, b.high)};
  }
  friend inline Floats8 operator-(Floats8 a, Floats8 b) {
    return {_mm_sub_ps(a.low, b.low), _mm_sub_ps(a.high, b.high)};
  }
  friend inline Floats8 operator*(Floats8 a, Floats8 b) {
    return {_mm_mul_ps(a.low, b.low), _mm_mul_ps(a.high, b.high)};
  }
  friend inline Floats8 operator/(Floats8 a, Floats8 b) {
    return {_mm_div_ps(a.low, b.low), _mm_div_ps(a.high, b.high)};
  }
};

static inline Floats8 multiply_add(Floats8 a, Floats8 b, Floats8 c) { return a * b + c; }
static inline Floats8 multiply_subtract(Floats8 a, Floats8 b, Floats8 c) { return a * b - c; }
static inline Floats8 subtract_product(Floats8 c, Floats8 a, Floats8 b) { return c - a * b; }
static inline Floats8 minimum(Floats8 a, Floats8 b) { return {_mm_min_ps(a.low, b.low), _mm_min_ps(a.high, b.high)}; }
static inline Floats8 maximum(Floats8 a, Floats8 b) { return {_mm_max_ps(a.low, b.low), _mm_max_ps(a.high, b.high)}; }
static inline Floats8 square_root(Floats8 a) { return {_mm_sqrt_ps(a.low), _mm_sqrt_ps(a.high)}; }

static inline Floats8 bits_of(uint32_t bits) {
  return Floats8::both_halves(_mm_castsi128_ps(_mm_set1_epi32(static_cast<int>(bits))));
}
static inline Floats8 bit_and(Floats8 a, Floats8 b) { return {_mm_and_ps(a.low, b.low), _mm_and_ps(a.high, b.high)}; }
static inline Floats8 bit_or(Floats8 a, Floats8 b) { return {_mm_or_ps(a.low, b.low), _mm_or_ps(a.high, b.high)}; }
static inline Floats8 bit_and_not(Floats8 a, Floats8 b) {
  return {_mm_andnot_ps(a.low, b.low), _mm_andnot_ps(a.high, b.high)};
}
static inline Floats8 absolute(Floats8 a) { return bit_and(a, bits_of(0x7FFFFFFFu)); }
static inline void store_bits(Floats8 a, uint32_t* to) { a.store(reinterpret_cast<float*>(to)); }
static inline Floats8 greater_equal_mask(Floats8 a, Floats8 b) {
  return {_mm_cmpge_ps(a.low, b.low), _mm_cmpge_ps(a.high, b.high)};
}
static inline Floats8 greater_mask(Floats8 a, Floats8 b) {
  return {_mm_cmpgt_ps(a.low, b.low), _mm_cmpgt_ps(a.high, b.high)};
}
static inline Floats8 select(Floats8 mask, Floats8 yes, Floats8 no) {
  return {_mm_blendv_ps(no.low, yes.low, mask.low), _mm_blendv_ps(no.high, yes.high, mask.high)};
}
static inline Floats8 mask_of_eight(uint32_t bits) {
  const __m128i all_bits = _mm_set1_epi32(static_cast<int>(bits));
  const __m128i low = _mm_setr_epi32(1, 2, 4, 8), high = _mm_setr_epi32(16, 32, 64, 128);
  return {_mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(all_bits, low), low)),
          _mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(all_bits, high), high))};
}

static inline Floats8 horizontal_max(Floats8 a) {
  const __m128 halves = _mm_max_ps(a.low, a.high);
  const __m128 pairs = _mm_max_ps(halves, _mm_movehl_ps(halves, halves));
  return Floats8::splat(_mm_cvtss_f32(_mm_max_ss(pairs, _mm_shuffle_ps(pairs, pairs, 1))));
}

static inline uint32_t lanes_of(__m128 low, __m128 high) {
  return static_cast<uint32_t>(_mm_movemask_ps(low) | _mm_movemask_ps(high) << 4);
}
static inline uint32_t signs_of(Floats8 a) { return lanes_of(a.low, a.high); }
static inline uint32_t at_most(Floats8 a, Floats8 b) {
  return lanes_of(_mm_cmple_ps(a.low, b.low), _mm_cmple_ps(a.high, b.high));
}
static inline uint32_t below(Floats8 a, Floats8 b) {
  return lanes_of(_mm_cmplt_ps(a.low, b.low), _mm_cmplt_ps(a.high, b.high));
}

static inline uint32_t have_bits(Floats8 a, uint32_t bits) {
  const __m128i wanted = _mm_set1_epi32(static_cast<int>(bits));
  const auto half = [wanted](__m128 lanes) {
    return _mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(_mm_castps_si128(lanes), wanted), wanted));
  };
  return lanes_of(half(a.low), half(a.high));
}

static inline uint32_t pack_children(const TriangleNode& node, Floats8 near, Floats8 far, uint32_t* children) {
  const uint32_t set = at_most(near, far);
  uint32_t count = 0;
  for (uint32_t slot = 0; slot < kTreeWidth; ++slot) {
    children[count] = node.child[slot];
    count += set >> slot & 1u;
  }
  return count;
}

static inline uint32_t pack_slots(const TriangleNode& node, Floats8 near, Floats8 far, uint32_t octant,
                                  uint32_t* slots) {
  const uint32_t set = at_most(near, far), order = node.order[octant];
  uint32_t count = 0;
  for (uint32_t rank = 0; rank < kTreeWidth; ++rank) {
    slots[count] = order >> (3 * rank);
    count += set >> (slots[count] & 7u) & 1u;
  }
  return count;
}

static inline uint32_t pack_sorted(const TriangleNode& node, Floats8 near, Floats8 far, uint32_t octant,
                                   uint32_t* children, float* nears) {
  alignas(16) float entered[kTreeWidth];
  near.store(entered);
  const uint32_t set = at_most(near, far), order = node.order[octant];
  uint32_t count = 0;
  for (uint32_t rank = 0; rank < kTreeWidth; ++rank) {
    const uint32_t slot = order >> (3 * rank) & 7u;
    children[count] = node.child[slot];
    nears[count] = entered[slot];
    count += set >> slot & 1u;
  }
  return count;
}

static inline float least(Floats8 a) {
  const __m128 half = _mm_min_ps(a.low, a.high);
  const __m128 pair = _mm_min_ps(half, _mm_movehl_ps(half, half));
  return _mm_cvtss_f32(_mm_min_ss(pair, _mm_movehdup_ps(pair)));
}

struct Keys8 {
  __m128i low, high;

  static inline Keys8 load(const uint32_t* from) {
    const auto* const at = reinterpret_cast<const __m128i*>(from);
    return {_mm_load_si128(at), _mm_load_si128(at + 1)};
  }
  inline void store(uint32_t* to) const {
    auto* const at = reinterpret_cast<__m128i*>(to);
    _mm_store_si128(at, low);
    _mm_store_si128(at + 1, high);
  }
};

static inline Keys8 keys_of(Floats8 distances) {
  const __m128i clear = _mm_set1_epi32(7);
  return {_mm_or_si128(_mm_andnot_si128(clear, _mm_castps_si128(distances.low)), _mm_setr_epi32(0, 1, 2, 3)),
          _mm_or_si128(_mm_andnot_si128(clear, _mm_castps_si128(distances.high)), _mm_setr_epi32(4, 5, 6, 7))};
}

static inline uint32_t least_key(Keys8 keys) {
  const __m128i half = _mm_min_epu32(keys.low, keys.high);
  const __m128i pair = _mm_min_epu32(half, _mm_shuffle_epi32(half, _MM_SHUFFLE(1, 0, 3, 2)));
  return static_cast<uint32_t>(
      _mm_cvtsi128_si32(_mm_min_epu32(pair, _mm_shuffle_epi32(pair, _MM_SHUFFLE(2, 3, 0, 1)))));
}

static inline Keys8 without(Keys8 keys, uint32_t key) {
  const __m128i visited = _mm_set1_epi32(static_cast<int>(key));
  return {_mm_or_si128(keys.low, _mm_cmpeq_epi32(keys.low, visited)),
          _mm_or_si128(keys.high, _mm_cmpeq_epi32(keys.high, visited))};
}

static inline void pack_entries(uint32_t* children, float* nears, uint32_t from, uint32_t set, uint32_t to) {
  for (uint32_t entry = 0; entry < kTreeWidth; ++entry) {
    if ((set >> entry & 1u) == 0) continue;
    children[to] = children[from + entry];
    nears[to++] = nears[from + entry];
  }
}

static inline void transpose_three(const double* const* rows, Floats8* columns) {
  for (int axis = 0; axis < 3; ++axis) {
    alignas(16) float column[kTreeWidth];
    for (int row = 0; row < kTreeWidth; ++row) column[row] = static_cast<float>(rows[row][axis]);
    columns[axis] = Floats8::load(column);
  }
}

typedef double Doubles __attribute__((vector_size(32)));

static inline Doubles widened(float a, float b, float c) { return Doubles{a, b, c, c}; }

static inline Doubles widened(float a, float b, float c, float d) { return Doubles{a, b, c, d}; }

typedef long long DoubleMask __attribute__((vector_size(32)));

static inline uint32_t mask_bits(DoubleMask mask) {
  uint32_t bits = 0;
  for (uint32_t i = 0; i < 4; ++i) bits |= (mask[i] != 0 ? 1u : 0u) << i;
  return bits;
}

static inline void store_rounded(Doubles a, float* to) {
  for (int i = 0; i < 4; ++i) to[i] = static_cast<float>(a[i]);
}

static inline void store_rows(const Floats8* columns, char* to, size_t stride) {
  alignas(16) float values[4][kTreeWidth];
  for (size_t k = 0; k < 4; ++k) columns[k].store(values[k]);
  for (size_t i = 0; i < kTreeWidth; ++i)
    for (size_t k = 0; k < 4; ++k) __builtin_memcpy(to + i * stride + k * sizeof(float), &values[k][i], sizeof(float));
}

static inline void load_pairs(const char* from, size_t stride, Floats8& first, Floats8& second) {
  alignas(16) float columns[2][kTreeWidth];
  for (size_t i = 0; i < kTreeWidth; ++i)
    for (size_t k = 0; k < 2; ++k)
      __builtin_memcpy(&columns[k][i], from + i * stride + k * sizeof(float), sizeof(float));
  first = Floats8::load(columns[0]);
  second = Floats8::load(columns[1]);
}

static inline void pack_falling(const TriangleNode& node, uint32_t set, uint32_t flagged, uint32_t flag,
                                uint32_t* children) {
  uint32_t count = 0;
  for (uint32_t slot = kTreeWidth; slot-- > 0;) {
    children[count] = node.child[slot] | ((flagged >> slot & 1u) != 0 ? flag : 0u);
    count += set >> slot & 1u;
  }
}

static inline void pack_rising(const TriangleNode& node, uint32_t set, uint32_t flagged, uint32_t flag,
                               uint32_t* children) {
  uint32_t count = 0;
  for (uint32_t slot = 0; slot < kTreeWidth; ++slot) {
    children[count] = node.child[slot] | ((flagged >> slot & 1u) != 0 ? flag : 0u);
    count += set >> slot & 1u;
  }
}

static inline uint32_t block_slots(const TriangleNode& node) {
  const float* const children = reinterpret_cast<const float*>(node.child);
  return lanes_of(_mm_load_ps(children), _mm_load_ps(children + 4));
}

static inline void pack_numbers(const uint32_t* from, uint32_t count, uint32_t set, uint32_t* to) {
  uint32_t kept = 0;
  for (uint32_t i = 0; i < count; ++i) {
    to[kept] = from[i];
    kept += set >> i & 1u;
  }
}

static inline void copy_numbers(const uint32_t* from, uint32_t count, uint32_t* to) {
  __builtin_memcpy(to, from, count * sizeof(uint32_t));
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_SSE4_H_
