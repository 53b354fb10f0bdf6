// Rays and their slab test against boxes. No index structure culls a box that this test accepts. The test computes:
//
//   near = max over axes of  lo * rd - (o * rd + p)      far = min over axes of  hi * rd - (o * rd - p)
//   p = pad * (max |o| + max |box|) * |rd|
//
// Here o is the origin, d the direction, rd = 1 / d, and lo and hi are the sides of the box, each on one axis; lo and
// hi are swapped if d is negative. max |o| and max |box| are the largest |coordinates| of the origin and of the box,
// and pad is a constant, such as kTrianglePad.
//
// Every rounding step is monotone in the box, so a superset of a box never has a larger near or a smaller far. A hit
// requires that the slab test accepts the primitive's own box, so culling by any superset of that box never loses a
// hit. The pads cover the rounding errors of the slab test itself, of the conversion of a ray to float, and of the
// transform to mesh axes. A direction component below 1e-18 of the largest component is replaced by 1e-18 of the
// largest component; at all coordinates up to limits::kMaxCoordinate the resulting displacement is smaller than the
// pad. Source: Kay and Kajiya, Ray Tracing Complex Scenes, 1986 (slabs); Ize, Robust BVH Ray Traversal, 2013 (padding).
#ifndef LOCUS_CORE_GEOMETRY_RAY_H_
#define LOCUS_CORE_GEOMETRY_RAY_H_

#include <cmath>
#include <cstdint>
#include <limits>

#include "core/base/check.h"
#include "core/geometry/aabb.h"

namespace locus {

// Side of a triangle that rays ignore. A ray hits the front of a triangle if the vertices, in uploaded order, appear
// counter-clockwise from the ray's origin; queries of a scene with clockwise winding exchange kBack and kFront.
enum class Cull : uint8_t { kNone, kBack, kFront };
// Treatment of a ray that starts inside a closed solid. kSolid: the ray hits the solid at t = 0. kHollow: the ray hits
// the solid at the point where the ray leaves it. kSkip: the ray does not hit the solid.
enum class Inside : uint8_t { kSolid, kHollow, kSkip };

// Ray: the points origin + t * direction for 0 <= t <= t_max, both included. t is in units of the given direction,
// which need not have length 1 but must not be zero.
template <class S>
struct Ray {
  Vec3<S> origin;
  Vec3<S> direction;
  S t_max = std::numeric_limits<S>::infinity();
};

using Rayf = Ray<float>;
using Rayd = Ray<double>;

// Range of t in which a line is within a box; the range may lie outside [0, t_max]. Empty if near > far.
template <class S>
struct Interval {
  S near;
  S far;
};

// Values of `pad` in the slab test, each with the rounding errors that it covers.
inline constexpr double kTrianglePad = 0x1p-21;  // slab test in float: about eight roundings of 2^-24
inline constexpr double kInstancePad = 0x1p-20;  // transform to mesh axes and one rounding to float, any rotation
inline constexpr double kObjectPad = 0x1p-40;    // predicates of moving objects in double

// Ray preprocessed for many slab tests. Immutable; cheap to copy.
template <class S>
class SlabRay {
 public:
  // Makes a ray whose slab test widens every box by at least `reach` on each side, in addition to the pad. A search
  // along the path of a solid passes the extent of the solid as `reach`. A nonzero `reach` requires `pad` > 0. The
  // constructor is always inlined, because a call would take 27 more instructions for each ray.
  [[gnu::always_inline]] SlabRay(const Ray<S>& ray, double pad, double reach = 0)
      : origin_(ray.origin),
        direction_(ray.direction),
        pad_(static_cast<S>(pad)),
        magnitude_(max_component(abs(ray.origin))) {
    // margin() multiplies this term by `pad`. The factor 1 + 2^-18 adds the pad of `reach`, at most 2^-20 * reach, and
    // covers the rounding to float.
    if (reach != 0) magnitude_ += static_cast<S>(reach * (1 + 0x1p-18) / pad);
    LOCUS_DCHECK_GT(max_component(abs(ray.direction)), S{0});
    LOCUS_DCHECK_GE(pad_, S{0});
    const S smallest = static_cast<S>(1e-18) * max_component(abs(ray.direction));
    for (int axis = 0; axis < 3; ++axis) {
      const S d = ray.direction[axis];
      reciprocal_[axis] = S{1} / (std::abs(d) < smallest ? std::copysign(smallest, d) : d);
      center_[axis] = ray.origin[axis] * reciprocal_[axis];
    }
  }

  const Vec3<S>& origin() const { return origin_; }
  const Vec3<S>& direction() const { return direction_; }

  // Returns the distance by which the slab test widens a box whose largest |coordinate| is `box_magnitude`.
  S margin(S box_magnitude) const { return pad_ * (magnitude_ + box_magnitude); }

  // Returns the interval of the ray in the padded box.
  Interval<S> interval(const Aabb<S>& box) const { return interval(box, locus::magnitude(box)); }

  // Returns the interval of the ray in the box, padded for `box_magnitude` >= magnitude(box). A tree passes one
  // magnitude for all its boxes; a larger magnitude never makes the interval smaller.
  Interval<S> interval(const Aabb<S>& box, S box_magnitude) const {
    const S margin = this->margin(box_magnitude);
    Interval<S> result{-std::numeric_limits<S>::infinity(), std::numeric_limits<S>::infinity()};
    for (int axis = 0; axis < 3; ++axis) {
      const S rd = reciprocal_[axis];
      const S p = margin * std::abs(rd);
      const S lo = rd < 0 ? box.max[axis] : box.min[axis];
      const S hi = rd < 0 ? box.min[axis] : box.max[axis];
      result.near = std::max(result.near, lo * rd - (center_[axis] + p));
      result.far = std::min(result.far, hi * rd - (center_[axis] - p));
    }
    return result;
  }

 private:
  Vec3<S> origin_, direction_, reciprocal_, center_;
  S pad_;
  S magnitude_;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_RAY_H_
