// Per-ray constants of the ray kernels, computed for eight rays at a time.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_SETUP_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_SETUP_IMPL_H_

#include <cstddef>

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/ray_kernels.h"

namespace locus {
namespace {

// Relative pad of the slab test of nodes: twice kTrianglePad, the pad with which SlabRay tests the box of a triangle.
// So rounding in float never culls a node that contains a triangle whose box SlabRay accepts.
constexpr float kTreePad = 0x1p-20f;

// Columns of PreparedRays: the constants computed for each ray. t is in units of the ray's direction. x, y and z are
// the axes of the projection along the ray: z is the axis of the direction's largest component (the first of equal
// components), as in TriangleRay; x and y are the other two axes, in the order that preserves the orientation of a
// projected triangle for all rays.
enum Column : uint32_t {
  kReciprocal = 0,  // three columns, one for each mesh axis: 1 / direction
  kNearOffset = 3,  // three columns: a slab is entered at t = bound * reciprocal - near offset
  kFarOffset = 6,   // three columns: a slab is left at t = bound * reciprocal - far offset
  kLimit = 9,
  kFromX,
  kFromY,
  kFromZ,
  kShearX,
  kShearY,
  kReciprocalZ,
  kEdgeScale,  // error bound of the edge functions: scale * extent + floor
  kEdgeFloor,
  kEdgeNoise,  // error bound of t: (edge noise * bound of edge functions * extent + start noise) / determinant + floor
  kStartNoise,
  kTFloor,
  kAxisX,  // integers: the mesh axes (0 to 2) that are x, y and z of the projection
  kAxisY,
  kAxisZ,
  kOctant,  // integer: bit k is set if component k of the direction is negative
  kColumns
};

// Constants of eight rays: one column for each constant, one lane for each ray.
struct alignas(64) PreparedRays {
  float columns[kColumns][kTreeWidth];
};

// Reference to the constants of one ray: one lane of PreparedRays.
class PreparedRay {
 public:
  inline PreparedRay() = default;
  inline PreparedRay(const PreparedRays& rays, size_t lane) : first_column_(&rays.columns[0][lane]) {}

  inline float value(uint32_t column) const { return first_column_[size_t{column} * kTreeWidth]; }
  inline Floats8 splat(uint32_t column) const { return Floats8::splat(value(column)); }
  inline uint32_t integer(uint32_t column) const {
    uint32_t bits;
    __builtin_memcpy(&bits, first_column_ + size_t{column} * kTreeWidth, sizeof(bits));
    return bits;
  }

 private:
  const float* first_column_;
};

// Eight rays as columns.
struct RayColumns {
  Floats8 origin[3], direction[3], limit;
};

// Converts up to eight rays to columns. If `count` is less than eight, the last ray is repeated.
static inline RayColumns columns_of(const KernelRay* rays, size_t count) {
  const double* first[kTreeWidth];
  const double* second[kTreeWidth];
  RayColumns columns;
  alignas(32) float limits[kTreeWidth];
  for (size_t i = 0; i < kTreeWidth; ++i) {
    const KernelRay& ray = rays[i < count ? i : count - 1];
    first[i] = ray.origin;
    second[i] = ray.direction;
    limits[i] = ray.limit;
  }
  transpose_three(first, columns.origin);
  transpose_three(second, columns.direction);
  columns.limit = Floats8::load(limits);
  return columns;
}

// Projection axes of eight rays. The projection axis z of a ray is the mesh axis of its direction's largest component;
// its projection axes x and y are the two other mesh axes. Given the components of eight vectors on the mesh axes,
// first(), second() and along() return their components on the projection axes x, y and z.
class Projection {
 public:
  inline Projection(const Floats8* direction, const KernelRay* rays, size_t count) {
    const Floats8 x = absolute(direction[0]), y = absolute(direction[1]), z = absolute(direction[2]);
    const Floats8 longest = maximum(maximum(x, y), z);
    is_x_ = greater_equal_mask(x, longest);
    is_y_ = greater_equal_mask(y, longest);
    const uint32_t is_max_x = at_most(longest, x), is_max_y = at_most(longest, y), is_max_z = at_most(longest, z);
    const uint32_t ties = (is_max_x & (is_max_y | is_max_z)) | (is_max_y & is_max_z);
    if (ties != 0 && !planted(PlantedBug::kKernelFloatAxis)) decide_ties(ties, rays, count);
    backwards_ = planted(PlantedBug::kKernelWinding) ? bits_of(0) : along(direction[0], direction[1], direction[2]);
  }

  inline Floats8 along(Floats8 x, Floats8 y, Floats8 z) const { return select(is_x_, x, select(is_y_, y, z)); }
  inline Floats8 first(Floats8 x, Floats8 y, Floats8 z) const {
    return select(backwards_, along(z, x, y), along(y, z, x));
  }
  inline Floats8 second(Floats8 x, Floats8 y, Floats8 z) const {
    return select(backwards_, along(y, z, x), along(z, x, y));
  }

 private:
  // Chooses the axis z in double for the rays in the mask `ties`, whose largest components are equal in float.
  // The choice must be that of TriangleRay, because the last bits of t depend on the axis.
  void decide_ties(uint32_t ties, const KernelRay* rays, size_t count) {
    alignas(32) float x[kTreeWidth], y[kTreeWidth];
    is_x_.store(x);
    is_y_.store(y);
    for (; ties != 0; ties &= ties - 1u) {
      const auto i = static_cast<size_t>(__builtin_ctz(ties));
      const double* const d = rays[i < count ? i : count - 1].direction;
      const double abs_x = __builtin_fabs(d[0]), abs_y = __builtin_fabs(d[1]), abs_z = __builtin_fabs(d[2]);
      x[i] = abs_x >= abs_y && abs_x >= abs_z ? -1.0f : 1.0f;
      y[i] = abs_y >= abs_z ? -1.0f : 1.0f;
    }
    is_x_ = Floats8::load(x);
    is_y_ = Floats8::load(y);
  }

  Floats8 is_x_, is_y_, backwards_;  // masks: the sign bit of a lane is set if true
};

// Computes the slab constants and the octant of each ray. `reach` is the largest |coordinate| of the ray's origin plus
// the largest |coordinate| of the mesh. Writes the reciprocals of the direction components to the three elements of
// `inverse`.
static inline void prepare_slabs(const RayColumns& rays, Floats8 reach, Floats8* inverse, PreparedRays& to) {
  const Floats8* const d = rays.direction;
  const Floats8 longest = maximum(maximum(absolute(d[0]), absolute(d[1])), absolute(d[2]));
  // A component smaller than 1e-18 of the largest component is replaced by 1e-18 of the largest component, as in
  // SlabRay.
  const Floats8 min_component = longest * Floats8::splat(1e-18f),
                pad = reach * Floats8::splat(planted(PlantedBug::kKernelTreePad) ? 0 : kTreePad);
  Floats8 octant = bits_of(0);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    inverse[axis] =
        Floats8::splat(1) / bit_or(maximum(absolute(d[axis]), min_component), bit_and(bits_of(0x80000000u), d[axis]));
    const Floats8 center = rays.origin[axis] * inverse[axis], offset = pad * absolute(inverse[axis]);
    inverse[axis].store(to.columns[kReciprocal + axis]);
    (center + offset).store(to.columns[kNearOffset + axis]);
    (center - offset).store(to.columns[kFarOffset + axis]);
    octant = bit_or(octant, select(d[axis], bits_of(1u << axis), bits_of(0)));
  }
  octant.store(to.columns[kOctant]);
}

// Computes the error bounds explained in ray_block_impl.h, where R denotes `reach`.
static inline void prepare_bounds(Floats8 reach, Floats8 abs_reciprocal_z, PreparedRays& to) {
  (reach * Floats8::splat(0x1p-17f)).store(to.columns[kEdgeScale]);
  (reach * reach * Floats8::splat(0x1p-36f)).store(to.columns[kEdgeFloor]);
  (Floats8::splat(6) * abs_reciprocal_z).store(to.columns[kEdgeNoise]);
  (reach * reach * reach * Floats8::splat(0x1p-42f) * abs_reciprocal_z).store(to.columns[kStartNoise]);
  (reach * Floats8::splat(0x1p-20f) * abs_reciprocal_z).store(to.columns[kTFloor]);
}

// Computes the constants of the first eight of `count` rays, or of all rays if `count` is less than eight. `magnitude`
// is the largest |coordinate| of the mesh.
static inline void prepare(const KernelRay* rays, size_t count, float magnitude, PreparedRays& to) {
  const RayColumns columns = columns_of(rays, count);
  const Floats8* const o = columns.origin;
  const Floats8* const d = columns.direction;
  const Floats8 reach = maximum(maximum(absolute(o[0]), absolute(o[1])), absolute(o[2])) + Floats8::splat(magnitude);
  Floats8 inverse[3];
  prepare_slabs(columns, reach, inverse, to);
  columns.limit.store(to.columns[kLimit]);
  const Projection axes(d, rays, count);
  const Floats8 inverse_z = axes.along(inverse[0], inverse[1], inverse[2]);
  prepare_bounds(reach, absolute(inverse_z), to);
  inverse_z.store(to.columns[kReciprocalZ]);
  (axes.first(d[0], d[1], d[2]) * inverse_z).store(to.columns[kShearX]);
  (axes.second(d[0], d[1], d[2]) * inverse_z).store(to.columns[kShearY]);
  axes.first(o[0], o[1], o[2]).store(to.columns[kFromX]);
  axes.second(o[0], o[1], o[2]).store(to.columns[kFromY]);
  axes.along(o[0], o[1], o[2]).store(to.columns[kFromZ]);
  axes.first(bits_of(0), bits_of(1), bits_of(2)).store(to.columns[kAxisX]);
  axes.second(bits_of(0), bits_of(1), bits_of(2)).store(to.columns[kAxisY]);
  axes.along(bits_of(0), bits_of(1), bits_of(2)).store(to.columns[kAxisZ]);
}

}  // namespace
}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_RAY_SETUP_IMPL_H_
