// Vector of sixteen floats for beams of rays: two vectors of eight floats. The functions are documented in
// floats8_avx2.h; a mask of bits has one bit per lane. All functions have internal linkage: see floats8.h.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS16_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS16_H_

#include "core/index/bvh/kernels/floats8.h"

namespace locus {
namespace {

struct Floats16 {
  Floats8 low, high;

  static inline Floats16 both(Floats8 half) { return {half, half}; }
  static inline Floats16 splat(float value) { return both(Floats8::splat(value)); }
  static inline Floats16 load(const float* from) { return {Floats8::load(from), Floats8::load(from + kTreeWidth)}; }
  inline void store(float* to) const {
    low.store(to);
    high.store(to + kTreeWidth);
  }

  friend inline Floats16 operator+(Floats16 a, Floats16 b) { return {a.low + b.low, a.high + b.high}; }
  friend inline Floats16 operator-(Floats16 a, Floats16 b) { return {a.low - b.low, a.high - b.high}; }
  friend inline Floats16 operator*(Floats16 a, Floats16 b) { return {a.low * b.low, a.high * b.high}; }
  friend inline Floats16 operator/(Floats16 a, Floats16 b) { return {a.low / b.low, a.high / b.high}; }
};

static inline Floats16 multiply_add(Floats16 a, Floats16 b, Floats16 c) {
  return {multiply_add(a.low, b.low, c.low), multiply_add(a.high, b.high, c.high)};
}
static inline Floats16 minimum(Floats16 a, Floats16 b) { return {minimum(a.low, b.low), minimum(a.high, b.high)}; }
static inline Floats16 maximum(Floats16 a, Floats16 b) { return {maximum(a.low, b.low), maximum(a.high, b.high)}; }
static inline Floats16 absolute(Floats16 a) { return {absolute(a.low), absolute(a.high)}; }
static inline Floats16 bit_and(Floats16 a, Floats16 b) { return {bit_and(a.low, b.low), bit_and(a.high, b.high)}; }
static inline Floats16 bit_or(Floats16 a, Floats16 b) { return {bit_or(a.low, b.low), bit_or(a.high, b.high)}; }
static inline Floats16 bit_and_not(Floats16 a, Floats16 b) {
  return {bit_and_not(a.low, b.low), bit_and_not(a.high, b.high)};
}

static inline uint32_t at_most(Floats16 a, Floats16 b) { return at_most(a.low, b.low) | at_most(a.high, b.high) << 8; }
static inline uint32_t signs_of(Floats16 a) { return signs_of(a.low) | signs_of(a.high) << 8; }
static inline Floats16 mask_of(uint32_t bits) { return {mask_of_eight(bits & 255u), mask_of_eight(bits >> 8)}; }
static inline Floats16 greater_equal_mask(Floats16 a, Floats16 b) {
  return {greater_equal_mask(a.low, b.low), greater_equal_mask(a.high, b.high)};
}
static inline Floats16 greater_mask(Floats16 a, Floats16 b) {
  return {greater_mask(a.low, b.low), greater_mask(a.high, b.high)};
}
static inline Floats16 select(Floats16 mask, Floats16 yes, Floats16 no) {
  return {select(mask.low, yes.low, no.low), select(mask.high, yes.high, no.high)};
}

// Return the least and the greatest of the sixteen lanes.
static inline float least(Floats16 a) { return least(minimum(a.low, a.high)); }
static inline float greatest(Floats16 a) { return -least(Floats16::splat(0) - a); }

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_FLOATS16_H_
