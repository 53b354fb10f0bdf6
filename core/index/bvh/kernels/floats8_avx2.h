// Eight floats at once in one register of AVX2: see floats8.h.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_AVX2_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_AVX2_H_

#include <immintrin.h>

#include <cstdint>

#include "core/index/bvh/triangle_tree.h"

namespace locus {
namespace {

struct Floats8 {
  __m256 v;

  static inline Floats8 all(float value) { return {_mm256_set1_ps(value)}; }
  static inline Floats8 load(const float* from) { return {_mm256_load_ps(from)}; }
  static inline Floats8 load_any(const float* from) { return {_mm256_loadu_ps(from)}; }
  inline void store(float* to) const { _mm256_storeu_ps(to, v); }

  friend inline Floats8 operator+(Floats8 a, Floats8 b) { return {_mm256_add_ps(a.v, b.v)}; }
  friend inline Floats8 operator-(Floats8 a, Floats8 b) { return {_mm256_sub_ps(a.v, b.v)}; }
  friend inline Floats8 operator*(Floats8 a, Floats8 b) { return {_mm256_mul_ps(a.v, b.v)}; }
  friend inline Floats8 operator/(Floats8 a, Floats8 b) { return {_mm256_div_ps(a.v, b.v)}; }
};

static inline Floats8 multiply_add(Floats8 a, Floats8 b, Floats8 c) { return {_mm256_fmadd_ps(a.v, b.v, c.v)}; }
static inline Floats8 multiply_subtract(Floats8 a, Floats8 b, Floats8 c) { return {_mm256_fmsub_ps(a.v, b.v, c.v)}; }
static inline Floats8 subtract_product(Floats8 c, Floats8 a, Floats8 b) { return {_mm256_fnmadd_ps(a.v, b.v, c.v)}; }
static inline Floats8 minimum(Floats8 a, Floats8 b) { return {_mm256_min_ps(a.v, b.v)}; }
static inline Floats8 maximum(Floats8 a, Floats8 b) { return {_mm256_max_ps(a.v, b.v)}; }
static inline Floats8 square_root(Floats8 a) { return {_mm256_sqrt_ps(a.v)}; }
static inline Floats8 absolute(Floats8 a) { return {_mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.v)}; }

static inline Floats8 bits_of(uint32_t bits) {
  return {_mm256_castsi256_ps(_mm256_set1_epi32(static_cast<int>(bits)))};
}
static inline Floats8 bit_and(Floats8 a, Floats8 b) { return {_mm256_and_ps(a.v, b.v)}; }
static inline Floats8 bit_or(Floats8 a, Floats8 b) { return {_mm256_or_ps(a.v, b.v)}; }
static inline void store_bits(Floats8 a, uint32_t* to) { a.store(reinterpret_cast<float*>(to)); }
// Lanes whose sign bit is set where a >= b.
static inline Floats8 where_at_least(Floats8 a, Floats8 b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_GE_OQ)}; }
// By the sign bit of `where`.
static inline Floats8 choose(Floats8 where, Floats8 yes, Floats8 no) {
  return {_mm256_blendv_ps(no.v, yes.v, where.v)};
}

// The largest lane, in all lanes.
static inline Floats8 largest(Floats8 a) {
  const __m256 halves = _mm256_max_ps(a.v, _mm256_permute2f128_ps(a.v, a.v, 1));
  const __m256 pairs = _mm256_max_ps(halves, _mm256_permute_ps(halves, _MM_SHUFFLE(1, 0, 3, 2)));
  return {_mm256_max_ps(pairs, _mm256_permute_ps(pairs, _MM_SHUFFLE(2, 3, 0, 1)))};
}

// One bit a lane. False for NaN.
static inline uint32_t at_most(Floats8 a, Floats8 b) {
  return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)));
}
static inline uint32_t below(Floats8 a, Floats8 b) {
  return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)));
}

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

// Writes the children that are entered no later than left, in the order of their slots, and returns how many; eight
// places are written.
static inline uint32_t pack_children(const TriangleNode& node, Floats8 near, Floats8 far, uint32_t* children) {
  const uint32_t set = at_most(near, far);
  const __m256i all = _mm256_load_si256(reinterpret_cast<const __m256i*>(node.child));
  const __m256i packed = _mm256_permutevar8x32_epi32(all, packing(set));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children), packed);
  return static_cast<uint32_t>(__builtin_popcount(set));
}

// A node's slots from far to near for that octant of directions: the lowest three bits of each number.
static inline __m256i slots_in_order(const TriangleNode& node, uint32_t octant) {
  const __m256i shifts = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
  return _mm256_srlv_epi32(_mm256_set1_epi32(static_cast<int>(node.order[octant])), shifts);
}

// Likewise their slots from far to near for that octant of directions: the lowest three bits of what is written.
static inline uint32_t pack_slots(const TriangleNode& node, Floats8 near, Floats8 far, uint32_t octant,
                                  uint32_t* slots) {
  const __m256i order = slots_in_order(node, octant);
  const __m256 met = _mm256_permutevar8x32_ps(_mm256_cmp_ps(near.v, far.v, _CMP_LE_OQ), order);
  const auto set = static_cast<uint32_t>(_mm256_movemask_ps(met));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(slots), _mm256_permutevar8x32_epi32(order, packing(set)));
  return static_cast<uint32_t>(__builtin_popcount(set));
}

// Likewise the children themselves, and how near they are.
static inline uint32_t pack_sorted(const TriangleNode& node, Floats8 near, Floats8 far, uint32_t octant,
                                   uint32_t* children, float* nears) {
  const __m256i order = slots_in_order(node, octant);
  const __m256i child =
      _mm256_permutevar8x32_epi32(_mm256_load_si256(reinterpret_cast<const __m256i*>(node.child)), order);
  const __m256 sorted = _mm256_permutevar8x32_ps(near.v, order);
  const __m256 met = _mm256_permutevar8x32_ps(_mm256_cmp_ps(near.v, far.v, _CMP_LE_OQ), order);
  const auto set = static_cast<uint32_t>(_mm256_movemask_ps(met));
  const __m256i packed = packing(set);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children), _mm256_permutevar8x32_epi32(child, packed));
  _mm256_storeu_ps(nears, _mm256_permutevar8x32_ps(sorted, packed));
  return static_cast<uint32_t>(__builtin_popcount(set));
}

// Moves the entries of a pair of columns whose bits are set to `to`, which is not behind `from`; eight places are read
// and written.
static inline void pack_entries(uint32_t* children, float* nears, uint32_t from, uint32_t set, uint32_t to) {
  const __m256i packed = packing(set);
  const __m256i child = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(children + from));
  const __m256 near = _mm256_loadu_ps(nears + from);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children + to), _mm256_permutevar8x32_epi32(child, packed));
  _mm256_storeu_ps(nears + to, _mm256_permutevar8x32_ps(near, packed));
}

static inline __m128 rounded_three(const double* from) {
  return _mm256_cvtpd_ps(_mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_loadu_pd(from)), _mm_load_sd(from + 2), 1));
}

// Eight rows of three numbers as three columns, rounded.
static inline void transpose_three(const double* const* rows, Floats8* columns) {
  __m256 pairs[4];
  for (int i = 0; i < 4; ++i) {
    const __m256 low = _mm256_castps128_ps256(rounded_three(rows[i]));
    pairs[i] = _mm256_insertf128_ps(low, rounded_three(rows[i + 4]), 1);
  }
  const __m256 xy01 = _mm256_unpacklo_ps(pairs[0], pairs[1]), xy23 = _mm256_unpacklo_ps(pairs[2], pairs[3]);
  const __m256 z01 = _mm256_unpackhi_ps(pairs[0], pairs[1]), z23 = _mm256_unpackhi_ps(pairs[2], pairs[3]);
  columns[0].v = _mm256_shuffle_ps(xy01, xy23, _MM_SHUFFLE(1, 0, 1, 0));
  columns[1].v = _mm256_shuffle_ps(xy01, xy23, _MM_SHUFFLE(3, 2, 3, 2));
  columns[2].v = _mm256_shuffle_ps(z01, z23, _MM_SHUFFLE(1, 0, 1, 0));
}

// Three doubles, one for each vertex of a triangle; the fourth is not used.
typedef double Doubles __attribute__((vector_size(32)));

static inline Doubles widened(float a, float b, float c) {
  return reinterpret_cast<Doubles>(_mm256_cvtps_pd(_mm_setr_ps(a, b, c, c)));
}

// The same as PackTable from the last lane to the first.
struct FallingPackTable {
  alignas(64) uint8_t lanes[256][8];
  constexpr FallingPackTable() : lanes() {
    for (int set = 0; set < 256; ++set) {
      int count = 0;
      for (int lane = 8; lane-- > 0;)
        if ((set >> lane & 1) != 0) lanes[set][count++] = static_cast<uint8_t>(lane);
    }
  }
};
static constexpr FallingPackTable kFallingPack;

// The children, with `flag` set in those whose bits are set in `flagged`.
static inline __m256i flagged_children(const TriangleNode& node, uint32_t flagged, uint32_t flag) {
  const __m256i lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i bits = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(flagged)), lanes);
  const __m256i flags = _mm256_and_si256(_mm256_cmpeq_epi32(bits, lanes), _mm256_set1_epi32(static_cast<int>(flag)));
  return _mm256_or_si256(_mm256_load_si256(reinterpret_cast<const __m256i*>(node.child)), flags);
}

// Writes the children whose bits are set, from the last slot to the first, with `flag` set in those whose bits are set
// in `flagged`; eight places are written.
static inline void pack_falling(const TriangleNode& node, uint32_t set, uint32_t flagged, uint32_t flag,
                                uint32_t* children) {
  const __m256i order =
      _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kFallingPack.lanes[set])));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children),
                      _mm256_permutevar8x32_epi32(flagged_children(node, flagged, flag), order));
}

// Likewise from the first slot to the last.
static inline void pack_rising(const TriangleNode& node, uint32_t set, uint32_t flagged, uint32_t flag,
                               uint32_t* children) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children),
                      _mm256_permutevar8x32_epi32(flagged_children(node, flagged, flag), packing(set)));
}

// The slots whose children are blocks, and those without a child.
static inline uint32_t block_slots(const TriangleNode& node) {
  return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_load_ps(reinterpret_cast<const float*>(node.child))));
}

// Up to eight numbers, of which `count` may be read.
static inline __m256i load_numbers(const uint32_t* from, uint32_t count) {
  const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  const __m256i within = _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(count)), lanes);
  return _mm256_maskload_epi32(reinterpret_cast<const int*>(from), within);
}

// Of `count` numbers, at most eight, writes those whose bits are set; eight places are written.
static inline void pack_numbers(const uint32_t* from, uint32_t count, uint32_t set, uint32_t* to) {
  const __m256i all = load_numbers(from, count);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permutevar8x32_epi32(all, packing(set)));
}

// Copies numbers; up to seven places behind them are written too.
static inline void copy_numbers(const uint32_t* from, uint32_t count, uint32_t* to) {
  for (uint32_t done = 0; done < count; done += 8)
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + done), load_numbers(from + done, count - done));
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_AVX2_H_
