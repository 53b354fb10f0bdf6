// Vector of eight floats in one AVX2 register: see floats8.h.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_AVX2_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_AVX2_H_

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "core/index/bvh/triangle_tree.h"

namespace locus {
namespace {

struct Floats8 {
  __m256 v;

  static inline Floats8 splat(float value) { return {_mm256_set1_ps(value)}; }
  static inline Floats8 load(const float* from) { return {_mm256_load_ps(from)}; }
  static inline Floats8 load_unaligned(const float* from) { return {_mm256_loadu_ps(from)}; }
  inline void store(float* to) const { _mm256_storeu_ps(to, v); }

  friend inline Floats8 operator+(Floats8 a, Floats8 b) { return {_mm256_add_ps(a.v, b.v)}; }
  friend inline Floats8 operator-(Floats8 a, Floats8 b) { return {_mm256_sub_ps(a.v, b.v)}; }
  friend inline Floats8 operator*(Floats8 a, Floats8 b) { return {_mm256_mul_ps(a.v, b.v)}; }
  friend inline Floats8 operator/(Floats8 a, Floats8 b) { return {_mm256_div_ps(a.v, b.v)}; }
};

// Return a * b + c, a * b - c and c - a * b. AVX2 rounds each result once; floats8_sse4.h rounds the product and the
// sum.
static inline Floats8 multiply_add(Floats8 a, Floats8 b, Floats8 c) { return {_mm256_fmadd_ps(a.v, b.v, c.v)}; }
static inline Floats8 multiply_subtract(Floats8 a, Floats8 b, Floats8 c) { return {_mm256_fmsub_ps(a.v, b.v, c.v)}; }
static inline Floats8 subtract_product(Floats8 c, Floats8 a, Floats8 b) { return {_mm256_fnmadd_ps(a.v, b.v, c.v)}; }
// Return the minimum or maximum of each lane. If the lane of either operand is NaN, the result is the lane of `b`.
static inline Floats8 minimum(Floats8 a, Floats8 b) { return {_mm256_min_ps(a.v, b.v)}; }
static inline Floats8 maximum(Floats8 a, Floats8 b) { return {_mm256_max_ps(a.v, b.v)}; }
static inline Floats8 square_root(Floats8 a) { return {_mm256_sqrt_ps(a.v)}; }
static inline Floats8 absolute(Floats8 a) { return {_mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.v)}; }

// Returns a vector whose lanes all have the bit pattern `bits`.
static inline Floats8 bits_of(uint32_t bits) {
  return {_mm256_castsi256_ps(_mm256_set1_epi32(static_cast<int>(bits)))};
}
static inline Floats8 bit_and(Floats8 a, Floats8 b) { return {_mm256_and_ps(a.v, b.v)}; }
// Returns the bits of `b` that are not set in `a`.
static inline Floats8 bit_and_not(Floats8 a, Floats8 b) { return {_mm256_andnot_ps(a.v, b.v)}; }
static inline Floats8 bit_or(Floats8 a, Floats8 b) { return {_mm256_or_ps(a.v, b.v)}; }
static inline void store_bits(Floats8 a, uint32_t* to) { a.store(reinterpret_cast<float*>(to)); }
// Return masks for select(): all bits of a lane are set if a >= b, or if a > b.
static inline Floats8 greater_equal_mask(Floats8 a, Floats8 b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_GE_OQ)}; }
static inline Floats8 greater_mask(Floats8 a, Floats8 b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_GT_OQ)}; }
// Returns the lane of `yes` where the sign bit of the mask's lane is set, else the lane of `no`.
static inline Floats8 select(Floats8 mask, Floats8 yes, Floats8 no) { return {_mm256_blendv_ps(no.v, yes.v, mask.v)}; }
// Returns the mask for select() of a mask of bits.
static inline Floats8 mask_of_eight(uint32_t bits) {
  const __m256i lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i chosen = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(bits)), lanes);
  return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(chosen, lanes))};
}

// Returns a vector whose lanes all have the value of the largest lane of `a`.
static inline Floats8 horizontal_max(Floats8 a) {
  const __m256 halves = _mm256_max_ps(a.v, _mm256_permute2f128_ps(a.v, a.v, 1));
  const __m256 pairs = _mm256_max_ps(halves, _mm256_permute_ps(halves, _MM_SHUFFLE(1, 0, 3, 2)));
  return {_mm256_max_ps(pairs, _mm256_permute_ps(pairs, _MM_SHUFFLE(2, 3, 0, 1)))};
}

// Return a mask with one bit per lane, set if a <= b (at_most) or a < b (below). The bit is 0 if the lane of either
// operand is NaN.
static inline uint32_t at_most(Floats8 a, Floats8 b) {
  return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)));
}
static inline uint32_t below(Floats8 a, Floats8 b) {
  return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)));
}

// Returns a mask with one bit per lane: the sign bit of the lane. Also converts a mask for select() to a mask of bits.
static inline uint32_t signs_of(Floats8 a) { return static_cast<uint32_t>(_mm256_movemask_ps(a.v)); }

// Returns a mask with one bit per lane, set if a lane of `a` has all the bits that are set in `bits`.
static inline uint32_t have_bits(Floats8 a, uint32_t bits) {
  const __m256i wanted = _mm256_set1_epi32(static_cast<int>(bits));
  return signs_of(
      {_mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(_mm256_castps_si256(a.v), wanted), wanted))});
}

// Table with one row for each bit mask of eight lanes. A row begins with the indices of the lanes in the mask, in
// increasing order. Computed at compile time.
struct PackTable {
  alignas(64) uint8_t lanes[256][8] = {};
  constexpr PackTable() {
    for (int set = 0; set < 256; ++set) {
      int count = 0;
      for (int lane = 0; lane < 8; ++lane)
        if ((set >> lane & 1) != 0) lanes[set][count++] = static_cast<uint8_t>(lane);
    }
  }
};
static constexpr PackTable kPack;

// Returns the permutation that moves the lanes in the mask `set` to the front.
static inline __m256i pack_permutation(uint32_t set) {
  return _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kPack.lanes[set])));
}

// Writes the children whose boxes are hit (near <= far) in the order of their slots, and returns their number. May
// overwrite all eight elements of `children`.
static inline uint32_t pack_children(const TriangleNode& node, Floats8 near, Floats8 far, uint32_t* children) {
  const uint32_t set = at_most(near, far);
  const __m256i all_children = _mm256_load_si256(reinterpret_cast<const __m256i*>(node.child));
  const __m256i packed = _mm256_permutevar8x32_epi32(all_children, pack_permutation(set));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children), packed);
  return static_cast<uint32_t>(__builtin_popcount(set));
}

// Returns the slots of a node from far to near for an octant of ray directions, each in the lowest three bits of a
// lane. The other bits of a lane may be nonzero.
static inline __m256i slots_in_order(const TriangleNode& node, uint32_t octant) {
  const __m256i shifts = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
  return _mm256_srlv_epi32(_mm256_set1_epi32(static_cast<int>(node.order[octant])), shifts);
}

// Writes the slots of the children whose boxes are hit (near <= far), from far to near for an octant of ray directions,
// and returns their number. Each slot is in the lowest three bits of an element, whose other bits may be nonzero. May
// overwrite all eight elements of `slots`.
static inline uint32_t pack_slots(const TriangleNode& node, Floats8 near, Floats8 far, uint32_t octant,
                                  uint32_t* slots) {
  const __m256i order = slots_in_order(node, octant);
  const __m256 met = _mm256_permutevar8x32_ps(_mm256_cmp_ps(near.v, far.v, _CMP_LE_OQ), order);
  const auto set = static_cast<uint32_t>(_mm256_movemask_ps(met));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(slots), _mm256_permutevar8x32_epi32(order, pack_permutation(set)));
  return static_cast<uint32_t>(__builtin_popcount(set));
}

// Writes the children whose boxes are hit (near <= far) from far to near, with their entry distances in `nears`, and
// returns their number. May overwrite all eight elements of `children` and of `nears`.
static inline uint32_t pack_sorted(const TriangleNode& node, Floats8 near, Floats8 far, uint32_t octant,
                                   uint32_t* children, float* nears) {
  const __m256i order = slots_in_order(node, octant);
  const __m256i child =
      _mm256_permutevar8x32_epi32(_mm256_load_si256(reinterpret_cast<const __m256i*>(node.child)), order);
  const __m256 sorted = _mm256_permutevar8x32_ps(near.v, order);
  const __m256 met = _mm256_permutevar8x32_ps(_mm256_cmp_ps(near.v, far.v, _CMP_LE_OQ), order);
  const auto set = static_cast<uint32_t>(_mm256_movemask_ps(met));
  const __m256i packed = pack_permutation(set);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children), _mm256_permutevar8x32_epi32(child, packed));
  _mm256_storeu_ps(nears, _mm256_permutevar8x32_ps(sorted, packed));
  return static_cast<uint32_t>(__builtin_popcount(set));
}

// Returns the least of the eight lanes.
static inline float least(Floats8 a) {
  const __m128 half = _mm_min_ps(_mm256_castps256_ps128(a.v), _mm256_extractf128_ps(a.v, 1));
  const __m128 pair = _mm_min_ps(half, _mm_movehl_ps(half, half));
  return _mm_cvtss_f32(_mm_min_ss(pair, _mm_movehdup_ps(pair)));
}

// Keys of the eight slots of a node: see keys_of().
struct Keys8 {
  __m256i v;

  static inline Keys8 load(const uint32_t* from) { return {_mm256_load_si256(reinterpret_cast<const __m256i*>(from))}; }
  inline void store(uint32_t* to) const { _mm256_store_si256(reinterpret_cast<__m256i*>(to), v); }
};

// Returns a sort key for each slot: the bit pattern of its distance, with the lowest three bits replaced by the index
// of the slot. So keys order slots by distance, then by index. Precondition: no distance is negative.
static inline Keys8 keys_of(Floats8 distances) {
  const __m256i bits = _mm256_andnot_si256(_mm256_set1_epi32(7), _mm256_castps_si256(distances.v));
  return {_mm256_or_si256(bits, _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7))};
}

// Returns the least of the eight keys.
static inline uint32_t least_key(Keys8 keys) {
  const __m128i half = _mm_min_epu32(_mm256_castsi256_si128(keys.v), _mm256_extracti128_si256(keys.v, 1));
  const __m128i pair = _mm_min_epu32(half, _mm_shuffle_epi32(half, _MM_SHUFFLE(1, 0, 3, 2)));
  return static_cast<uint32_t>(
      _mm_cvtsi128_si32(_mm_min_epu32(pair, _mm_shuffle_epi32(pair, _MM_SHUFFLE(2, 3, 0, 1)))));
}

// Returns the keys with kVisitedKey in place of `key`.
static inline Keys8 without(Keys8 keys, uint32_t key) {
  return {_mm256_or_si256(keys.v, _mm256_cmpeq_epi32(keys.v, _mm256_set1_epi32(static_cast<int>(key))))};
}

// Packs both `children` and `nears`: takes the eight elements that begin at index `from`, keeps those in the mask
// `set`, and moves them, in the same order, to the indices from `to` on. Precondition: `to` <= `from`. May read and
// write eight elements of each array.
static inline void pack_entries(uint32_t* children, float* nears, uint32_t from, uint32_t set, uint32_t to) {
  const __m256i packed = pack_permutation(set);
  const __m256i child = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(children + from));
  const __m256 near = _mm256_loadu_ps(nears + from);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children + to), _mm256_permutevar8x32_epi32(child, packed));
  _mm256_storeu_ps(nears + to, _mm256_permutevar8x32_ps(near, packed));
}

// Returns the three doubles at `from`, rounded to float.
static inline __m128 rounded_three(const double* from) {
  return _mm256_cvtpd_ps(_mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_loadu_pd(from)), _mm_load_sd(from + 2), 1));
}

// Converts eight rows of three doubles to three columns of floats.
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

// Three doubles, one for each vertex of a triangle; the fourth lane is unused.
typedef double Doubles __attribute__((vector_size(32)));

static inline Doubles widened(float a, float b, float c) {
  return reinterpret_cast<Doubles>(_mm256_cvtps_pd(_mm_setr_ps(a, b, c, c)));
}
static inline Doubles widened(float a, float b, float c, float d) {
  return reinterpret_cast<Doubles>(_mm256_cvtps_pd(_mm_setr_ps(a, b, c, d)));
}

// Writes four doubles, rounded to float.
static inline void store_rounded(Doubles a, float* to) {
  _mm_storeu_ps(to, _mm256_cvtpd_ps(reinterpret_cast<__m256d>(a)));
}

// Result of a comparison of Doubles: all bits of an element are set if true.
typedef long long DoubleMask __attribute__((vector_size(32)));

// Returns a mask with one bit per element.
static inline uint32_t mask_bits(DoubleMask mask) {
  return static_cast<uint32_t>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask)));
}

// Writes four columns as eight rows of four 32-bit values, at `to`, `to` + `stride` bytes and so on.
static inline void store_rows(const Floats8* columns, char* to, size_t stride) {
  const __m256 ab_low = _mm256_unpacklo_ps(columns[0].v, columns[1].v),
               ab_high = _mm256_unpackhi_ps(columns[0].v, columns[1].v),
               cd_low = _mm256_unpacklo_ps(columns[2].v, columns[3].v),
               cd_high = _mm256_unpackhi_ps(columns[2].v, columns[3].v);
  const __m256 rows[4] = {_mm256_shuffle_ps(ab_low, cd_low, _MM_SHUFFLE(1, 0, 1, 0)),
                          _mm256_shuffle_ps(ab_low, cd_low, _MM_SHUFFLE(3, 2, 3, 2)),
                          _mm256_shuffle_ps(ab_high, cd_high, _MM_SHUFFLE(1, 0, 1, 0)),
                          _mm256_shuffle_ps(ab_high, cd_high, _MM_SHUFFLE(3, 2, 3, 2))};
  for (size_t i = 0; i < 4; ++i) {
    _mm_storeu_ps(reinterpret_cast<float*>(to + i * stride), _mm256_castps256_ps128(rows[i]));
    _mm_storeu_ps(reinterpret_cast<float*>(to + (i + 4) * stride), _mm256_extractf128_ps(rows[i], 1));
  }
}

// Loads the first two of the four 32-bit values at `from`, `from` + `stride` bytes and so on, eight times, as columns.
static inline void load_pairs(const char* from, size_t stride, Floats8& first, Floats8& second) {
  __m256 rows[4];
  for (size_t i = 0; i < 4; ++i) {
    const __m128 low = _mm_loadu_ps(reinterpret_cast<const float*>(from + i * stride));
    rows[i] = _mm256_insertf128_ps(_mm256_castps128_ps256(low),
                                   _mm_loadu_ps(reinterpret_cast<const float*>(from + (i + 4) * stride)), 1);
  }
  const __m256 rows01 = _mm256_unpacklo_ps(rows[0], rows[1]), rows23 = _mm256_unpacklo_ps(rows[2], rows[3]);
  first.v = _mm256_shuffle_ps(rows01, rows23, _MM_SHUFFLE(1, 0, 1, 0));
  second.v = _mm256_shuffle_ps(rows01, rows23, _MM_SHUFFLE(3, 2, 3, 2));
}

// Table like PackTable, but the indices of the lanes are in decreasing order.
struct FallingPackTable {
  alignas(64) uint8_t lanes[256][8] = {};
  constexpr FallingPackTable() {
    for (int set = 0; set < 256; ++set) {
      int count = 0;
      for (int lane = 8; lane-- > 0;)
        if ((set >> lane & 1) != 0) lanes[set][count++] = static_cast<uint8_t>(lane);
    }
  }
};
static constexpr FallingPackTable kFallingPack;

// Returns the values of a node's child slots, with the bits of `flag` set in the slots that are in the mask `flagged`.
static inline __m256i flagged_children(const TriangleNode& node, uint32_t flagged, uint32_t flag) {
  const __m256i lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i bits = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(flagged)), lanes);
  const __m256i flags = _mm256_and_si256(_mm256_cmpeq_epi32(bits, lanes), _mm256_set1_epi32(static_cast<int>(flag)));
  return _mm256_or_si256(_mm256_load_si256(reinterpret_cast<const __m256i*>(node.child)), flags);
}

// Writes the values of the child slots in the mask `set`, from the last slot to the first, with the bits of `flag` set
// in the values of slots that are also in the mask `flagged`. May overwrite all eight elements of `children`.
static inline void pack_falling(const TriangleNode& node, uint32_t set, uint32_t flagged, uint32_t flag,
                                uint32_t* children) {
  const __m256i order =
      _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kFallingPack.lanes[set])));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children),
                      _mm256_permutevar8x32_epi32(flagged_children(node, flagged, flag), order));
}

// Writes the same values as pack_falling(), but from the first slot to the last.
static inline void pack_rising(const TriangleNode& node, uint32_t set, uint32_t flagged, uint32_t flag,
                               uint32_t* children) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(children),
                      _mm256_permutevar8x32_epi32(flagged_children(node, flagged, flag), pack_permutation(set)));
}

// Returns the mask of the slots that hold a block or are unused.
static inline uint32_t block_slots(const TriangleNode& node) {
  return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_load_ps(reinterpret_cast<const float*>(node.child))));
}

// Loads the first `count` numbers at `from`, at most eight, without reading beyond them. Lanes without a number are 0.
static inline __m256i load_numbers(const uint32_t* from, uint32_t count) {
  const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  const __m256i within = _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(count)), lanes);
  return _mm256_maskload_epi32(reinterpret_cast<const int*>(from), within);
}

// Writes to `to` those of the `count` numbers at `from` that are in the mask `set`; `count` is at most eight. May
// overwrite eight elements at `to`.
static inline void pack_numbers(const uint32_t* from, uint32_t count, uint32_t set, uint32_t* to) {
  const __m256i all_numbers = load_numbers(from, count);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permutevar8x32_epi32(all_numbers, pack_permutation(set)));
}

// Copies `count` numbers from `from` to `to`. May overwrite up to seven elements after the copied numbers.
static inline void copy_numbers(const uint32_t* from, uint32_t count, uint32_t* to) {
  for (uint32_t done = 0; done < count; done += 8)
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + done), load_numbers(from + done, count - done));
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS8_AVX2_H_
