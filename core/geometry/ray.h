// Rays and their slab test against boxes. The test is the one culling rule of the house, so its rounding is part of
// what the product promises:
//
//   near = max over axes of  lo * rd - (o * rd + p)      far = min over axes of  hi * rd - (o * rd - p)
//   p = pad * (max |o| + max |box|) * |rd|               (lo and hi swapped where d is negative)
//
// Every rounding step is monotone in the box, so a superset of a box never has a larger near or a smaller far: a
// verdict that includes the slab test of the primitive's own box can be culled by any box around it and never changes.
// The pads cover the rounding of the slab test itself, of a ray to float and of the way into mesh axes. A direction
// component of zero is replaced by 1e-18 of the largest one, which no distance within the world makes visible behind
// the pad. Source: Kay and Kajiya, Ray Tracing Complex Scenes, 1986 (slabs); Ize, Robust BVH Ray Traversal, 2013
// (padding).
#ifndef LOCUS_CORE_GEOMETRY_RAY_H_
#define LOCUS_CORE_GEOMETRY_RAY_H_

#include <cmath>
#include <cstdint>
#include <limits>

#include "core/geometry/aabb.h"

namespace locus {

// Which side of a triangle is invisible. A front is seen counter-clockwise by the uploaded winding.
enum class Cull : uint8_t { kNone, kBack, kFront };
// What a closed solid answers to a ray that starts inside it: at t = 0, where the ray leaves, or nothing.
enum class Inside : uint8_t { kSolid, kHollow, kSkip };

// Points origin + t * direction for 0 <= t <= t_max, both included. t is in units of the direction as given, which is
// neither normalised nor zero.
template <class S>
struct Ray {
  Vec3<S> origin;
  Vec3<S> direction;
  S t_max = std::numeric_limits<S>::infinity();
};

using Rayf = Ray<float>;
using Rayd = Ray<double>;

// The part of a ray within a box, possibly outside [0, t_max]. Empty when near > far.
template <class S>
struct Interval {
  S near;
  S far;
};

// Pads of the slab test, relative to the magnitudes of origin and box.
inline constexpr double kTrianglePad = 0x1p-21;  // float slabs: about eight roundings of 2^-24
inline constexpr double kInstancePad = 0x1p-20;  // the way into mesh axes and one rounding to float, any rotation
inline constexpr double kObjectPad = 0x1p-40;    // double predicates of moving objects

// A ray made ready for many slab tests. Immutable; cheap to copy.
template <class S>
class SlabRay {
 public:
  SlabRay(const Ray<S>& ray, double pad)
      : origin_(ray.origin),
        direction_(ray.direction),
        pad_(static_cast<S>(pad)),
        magnitude_(max_component(abs(ray.origin))) {
    const S smallest = static_cast<S>(1e-18) * max_component(abs(ray.direction));
    for (int axis = 0; axis < 3; ++axis) {
      const S d = ray.direction[axis];
      reciprocal_[axis] = S{1} / (std::abs(d) < smallest ? std::copysign(smallest, d) : d);
      center_[axis] = ray.origin[axis] * reciprocal_[axis];
    }
  }

  const Vec3<S>& origin() const { return origin_; }
  const Vec3<S>& direction() const { return direction_; }

  // How far outside a box of that magnitude a ray may pass and still meet it here.
  S margin(S box_magnitude) const { return pad_ * (magnitude_ + box_magnitude); }

  // The box's own interval.
  Interval<S> interval(const Aabb<S>& box) const { return interval(box, locus::magnitude(box)); }

  // As above with a magnitude of at least the box's: one for a whole tree, say. The interval can only grow by it.
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
