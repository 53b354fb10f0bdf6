// References for closed convex solids in long double, by search instead of formulas: a solid is the set where a convex
// function, its gauge, is at most zero. If a point moves by e, its gauge changes by at most e. So `gauge <= e` holds
// for all points within e of the solid, and `gauge <= -e` holds only for points that stay inside when moved by e.
#ifndef LOCUS_TESTS_SUPPORT_CONVEX_REFERENCE_H_
#define LOCUS_TESTS_SUPPORT_CONVEX_REFERENCE_H_

#include <functional>
#include <optional>

#include "core/geometry/shape.h"
#include "tests/support/real.h"

namespace locus::test {

// Returns the argument at which a convex function of one variable is smallest, by golden section.
template <class Function>
Real argmin(const Function& f, Real low, Real high) {
  constexpr Real kGolden = 0.61803398874989484820L;
  Real a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  Real fa = f(a), fb = f(b);
  for (int step = 0; step < 80; ++step) {
    if (fa <= fb) {
      high = b;
      b = a;
      fb = fa;
      a = high - kGolden * (high - low);
      fa = f(a);
    } else {
      low = a;
      a = b;
      fa = fb;
      b = low + kGolden * (high - low);
      fb = f(b);
    }
  }
  return 0.5L * (low + high);
}

// Returns the argument between `no` and `yes` where a monotone predicate changes from false (at `no`) to true (at
// `yes`).
template <class Predicate>
Real turning_point(const Predicate& holds, Real no, Real yes) {
  for (int step = 0; step < 90; ++step) {
    const Real middle = 0.5L * (no + yes);
    (holds(middle) ? yes : no) = middle;
  }
  return yes;
}

struct RealInterval {
  Real near, far;
};

// Solid of a shape, in coordinates relative to its centre: far from the origin, absolute coordinates would lose digits.
class SolidReference {
 public:
  explicit SolidReference(const Shape& shape) : shape_(shape) {}

  // Returns the gauge of the solid (see the top of the file) at a point. `offset` is the point relative to the shape's
  // position, in world axes.
  Real gauge(Vec3r offset) const {
    const Vec3r p = turned_back(shape_.rotation, offset);
    const Vec3r size = to_real(shape_.size);
    switch (shape_.kind) {
      case ShapeKind::kPoint:
      case ShapeKind::kCompound:
        return length(p);
      case ShapeKind::kBall:
        return length(p) - shape_.radius;
      case ShapeKind::kBox: {
        const Vec3r outside = abs(p) - size;
        return max_component(outside);
      }
      case ShapeKind::kCapsule: {
        const Real aa = dot(size, size);
        const Real s = aa == 0 ? 0 : std::clamp(dot(p, size) / aa, Real{-1}, Real{1});
        return length(p - size * s) - shape_.radius;
      }
    }
    return 0;
  }

  // Returns the Euclidean distance of a point to the solid of zero radius: the point, box or segment.
  Real distance_to_core(Vec3r offset) const {
    if (shape_.kind != ShapeKind::kBox) return gauge(offset) + core_radius();
    const Vec3r outside = abs(turned_back(shape_.rotation, offset)) - to_real(shape_.size);
    return length(max(outside, Vec3r{}));
  }
  Real core_radius() const {
    return shape_.kind == ShapeKind::kBall || shape_.kind == ShapeKind::kCapsule ? shape_.radius : 0;
  }

  // Returns the interval of s in -reach .. reach in which the point offset + s * unit has a gauge of at most `grown`;
  // nullopt if there is none.
  std::optional<RealInterval> chord(Vec3r offset, Vec3r unit, Real reach, Real grown) const {
    const auto along = [&](Real s) { return gauge(offset + unit * s); };
    const Real middle = argmin(along, -reach, reach);
    if (along(middle) > grown) return std::nullopt;
    const auto within = [&](Real s) { return along(s) <= grown; };
    return RealInterval{turning_point(within, -reach, middle), turning_point(within, reach, middle)};
  }

 private:
  Shape shape_;
};

inline double largest_size(const Shape& shape) {
  return std::sqrt(squared_length(to_double(shape.size))) + double{shape.radius};
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CONVEX_REFERENCE_H_
