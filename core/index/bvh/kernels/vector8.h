// Eight vectors of three floats, for the kernels: see floats8.h. All functions have internal linkage.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_VECTOR8_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_VECTOR8_H_

#include "core/index/bvh/kernels/floats8.h"

namespace locus {
namespace {

struct Vector8 {
  Floats8 x, y, z;

  static inline Vector8 splat(const float* three) {
    return {Floats8::splat(three[0]), Floats8::splat(three[1]), Floats8::splat(three[2])};
  }
  static inline Vector8 load(const float (*rows)[kTreeWidth]) {
    return {Floats8::load(rows[0]), Floats8::load(rows[1]), Floats8::load(rows[2])};
  }
  friend inline Vector8 operator-(Vector8 a, Vector8 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
};

static inline Floats8 dot(Vector8 a, Vector8 b) { return multiply_add(a.x, b.x, multiply_add(a.y, b.y, a.z * b.z)); }

static inline Vector8 cross(Vector8 a, Vector8 b) {
  return {multiply_subtract(a.y, b.z, a.z * b.y), multiply_subtract(a.z, b.x, a.x * b.z),
          multiply_subtract(a.x, b.y, a.y * b.x)};
}

// Returns a - s * b.
static inline Vector8 subtract_product(Vector8 a, Floats8 s, Vector8 b) {
  return {subtract_product(a.x, s, b.x), subtract_product(a.y, s, b.y), subtract_product(a.z, s, b.z)};
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_VECTOR8_H_
