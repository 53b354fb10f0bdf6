// What the ray kernels need to know of their rays, made eight rays at a time.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_RAY_SETUP_IMPL_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_RAY_SETUP_IMPL_H_

#include <cstddef>

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/floats8.h"
#include "core/index/bvh/kernels/ray_kernels.h"

namespace locus {
namespace {

constexpr float kTreePad = 0x1p-20f;  // twice the triangle's own, so that no rounding here culls what that would keep

// What is known of each ray. Lengths along a ray count lengths of its direction. x, y and z are the axes of the
// projection along the ray: z the direction's largest component, the first of equals, as TriangleRay chooses it; x and
// y the others, so that seen along the ray x to y always turns the same way.
enum Column : uint32_t {
  kReciprocal = 0,  // of the direction, three by world axis
  kNearOffset = 3,  // three: a slab is entered at bound * reciprocal - near offset
  kFarOffset = 6,   // three: and left at bound * reciprocal - far offset
  kLimit = 9,
  kFromX,
  kFromY,
  kFromZ,
  kShearX,
  kShearY,
  kReciprocalZ,
  kEdgeScale,  // the bound of the edge functions: scale * extent + floor
  kEdgeFloor,
  kEdgeNoise,  // the bound of t: (edge noise * bound of edge functions * extent + start noise) / determinant + floor
  kStartNoise,
  kTFloor,
  kAxisX,  // the world axes of x, y and z: whole numbers
  kAxisY,
  kAxisZ,
  kOctant,  // bit k: component k of the direction is negative: a whole number
  kColumns
};

// Eight rays side by side.
struct alignas(64) PreparedRays {
  float columns[kColumns][kTreeWidth];
};

// One of them: where it stands in the first column.
class PreparedRay {
 public:
  inline PreparedRay() = default;
  inline PreparedRay(const PreparedRays& rays, size_t place) : at_(&rays.columns[0][place]) {}

  inline float number(uint32_t column) const { return at_[column * kTreeWidth]; }
  inline Floats8 spread(uint32_t column) const { return Floats8::all(number(column)); }
  inline uint32_t whole(uint32_t column) const {
    uint32_t bits;
    __builtin_memcpy(&bits, at_ + column * kTreeWidth, sizeof(bits));
    return bits;
  }

 private:
  const float* at_;
};

struct RayColumns {
  Floats8 origin[3], direction[3], limit;
};

// Rows to columns; behind `count` the last ray stands again.
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

// Puts the components of three-dimensional columns in the order of a projection's axes.
class Projection {
 public:
  inline Projection(const Floats8* direction, const KernelRay* rays, size_t count) {
    const Floats8 x = absolute(direction[0]), y = absolute(direction[1]), z = absolute(direction[2]);
    const Floats8 longest = maximum(maximum(x, y), z);
    is_x_ = where_at_least(x, longest);
    is_y_ = where_at_least(y, longest);
    const uint32_t most_x = at_most(longest, x), most_y = at_most(longest, y), most_z = at_most(longest, z);
    const uint32_t ties = (most_x & (most_y | most_z)) | (most_y & most_z);
    if (ties != 0 && !planted(PlantedBug::kKernelFloatAxis)) decide_ties(ties, rays, count);
    backwards_ = planted(PlantedBug::kKernelWinding) ? bits_of(0) : along(direction[0], direction[1], direction[2]);
  }

  inline Floats8 along(Floats8 x, Floats8 y, Floats8 z) const { return choose(is_x_, x, choose(is_y_, y, z)); }
  inline Floats8 first(Floats8 x, Floats8 y, Floats8 z) const {
    return choose(backwards_, along(z, x, y), along(y, z, x));
  }
  inline Floats8 second(Floats8 x, Floats8 y, Floats8 z) const {
    return choose(backwards_, along(y, z, x), along(z, x, y));
  }

 private:
  // In double: on the axis depend the last bits of t.
  void decide_ties(uint32_t ties, const KernelRay* rays, size_t count) {
    alignas(32) float x[kTreeWidth], y[kTreeWidth];
    is_x_.store(x);
    is_y_.store(y);
    for (; ties != 0; ties &= ties - 1u) {
      const auto i = static_cast<size_t>(__builtin_ctz(ties));
      const double* const d = rays[i < count ? i : count - 1].direction;
      const double size_x = __builtin_fabs(d[0]), size_y = __builtin_fabs(d[1]), size_z = __builtin_fabs(d[2]);
      x[i] = size_x >= size_y && size_x >= size_z ? -1.0f : 1.0f;
      y[i] = size_y >= size_z ? -1.0f : 1.0f;
    }
    is_x_ = Floats8::load(x);
    is_y_ = Floats8::load(y);
  }

  Floats8 is_x_, is_y_, backwards_;  // sign bits
};

static inline void prepare_slabs(const RayColumns& rays, Floats8 reach, Floats8* inverse, PreparedRays& to) {
  const Floats8* const d = rays.direction;
  const Floats8 longest = maximum(maximum(absolute(d[0]), absolute(d[1])), absolute(d[2]));
  // As SlabRay does: a component of zero becomes 1e-18 of the largest.
  const Floats8 least = longest * Floats8::all(1e-18f),
                pad = reach * Floats8::all(planted(PlantedBug::kKernelTreePad) ? 0 : kTreePad);
  Floats8 octant = bits_of(0);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    inverse[axis] = Floats8::all(1) / bit_or(maximum(absolute(d[axis]), least), bit_and(bits_of(0x80000000u), d[axis]));
    const Floats8 center = rays.origin[axis] * inverse[axis], around = pad * absolute(inverse[axis]);
    inverse[axis].store(to.columns[kReciprocal + axis]);
    (center + around).store(to.columns[kNearOffset + axis]);
    (center - around).store(to.columns[kFarOffset + axis]);
    octant = bit_or(octant, choose(d[axis], bits_of(1u << axis), bits_of(0)));
  }
  octant.store(to.columns[kOctant]);
}

static inline void prepare_bounds(Floats8 reach, Floats8 size_of_reciprocal_z, PreparedRays& to) {
  (reach * Floats8::all(0x1p-17f)).store(to.columns[kEdgeScale]);
  (reach * reach * Floats8::all(0x1p-36f)).store(to.columns[kEdgeFloor]);
  (Floats8::all(6) * size_of_reciprocal_z).store(to.columns[kEdgeNoise]);
  (reach * reach * reach * Floats8::all(0x1p-42f) * size_of_reciprocal_z).store(to.columns[kStartNoise]);
  (reach * Floats8::all(0x1p-20f) * size_of_reciprocal_z).store(to.columns[kTFloor]);
}

// Of the first eight rays, or as many as there are.
static inline void prepare(const KernelRay* rays, size_t count, float magnitude, PreparedRays& to) {
  const RayColumns columns = columns_of(rays, count);
  const Floats8* const o = columns.origin;
  const Floats8* const d = columns.direction;
  const Floats8 reach = maximum(maximum(absolute(o[0]), absolute(o[1])), absolute(o[2])) + Floats8::all(magnitude);
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
