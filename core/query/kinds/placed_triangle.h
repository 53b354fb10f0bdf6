// World axis-aligned bounds of an instance's triangles: PlacedTriangles has those that decide where CONSERVATIVE is
// asked, LoosePlacedTriangles wider ones that are part of the verdict of EXACT rays, balls and boxes, so that mesh axes
// and rounding to float never find a triangle far from where it is placed.
#ifndef LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_
#define LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_

#include <array>

#include "core/base/planted_bug.h"
#include "core/scene/statics/instance.h"

namespace locus {

using Corners = std::array<Vec3d, 3>;

// Returns the corners in world axes.
inline Corners corners_of(const Transform& transform, const Triangle& triangle) {
  return {transform.point_to_world(to_double(triangle.a)), transform.point_to_world(to_double(triangle.b)),
          transform.point_to_world(to_double(triangle.c))};
}

// Returns the bounds of the corners, grown by `margin` on every side.
inline Aabbd grown_around(const Corners& corners, double margin) {
  Aabbd bounds;
  for (const Vec3d corner : corners) bounds = merge(bounds, corner);
  return grown(bounds, margin);
}

// Bounds of the corners as they are placed in double, grown by 2^-40 of the magnitudes involved: of the translation and
// of the scaled mesh, since a translation may bring back a mesh that lies far from its own origin. They lie within
// Instance::bounds, which are grown by twice as much, so a triangle's bounds alone give its t, distance and point.
class PlacedTriangles {
 public:
  explicit PlacedTriangles(const Instance& instance)
      : transform_(instance.transform),
        margin_((planted(PlantedBug::kWidePlacedBounds) ? 0x1p-21 : kMargin) *
                (max_component(abs(instance.transform.translation)) +
                 4.0 * instance.transform.scale * magnitude(instance.mesh->bounds()))) {}

  Aabbd bounds_of_triangle(const Triangle& triangle) const {
    return bounds_of_corners(corners_of(transform_, triangle));
  }
  Aabbd bounds_of_corners(const Corners& corners) const { return grown_around(corners, margin_); }

  // Returns bounds that contain bounds_of_triangle() of every triangle within `box`: grown at least twice as much.
  Aabbd bounds_of_box(const Aabbf& box) const { return grown(bounds_to_world(transform_, box), 2 * margin_); }

 private:
  static constexpr double kMargin = 0x1p-41;

  const Transform& transform_;
  double margin_;
};

// Bounds of placed triangles, grown by a margin that covers every rounding of the exact tests, the way into mesh axes
// and one rounding to float there included.
class LoosePlacedTriangles {
 public:
  // `reach`: the largest coordinate or length of the query that the bounds will be held against; 0 where that test pads
  // by itself.
  explicit LoosePlacedTriangles(const Instance& instance, double reach = 0)
      : transform_(instance.transform),
        extent_(magnitude(instance.bounds) + reach),
        margin_(kMargin * extent_ + kPlacing * lever(instance)) {}

  Aabbd bounds_of_triangle(const Triangle& triangle) const {
    return grown_around(corners_of(transform_, triangle), margin_);
  }

  // Whether a query of `size` around `center`, in mesh axes, that has a point in common with a triangle there is
  // certain to meet bounds_of_triangle(): rounding its centre and size to float moves it by less than 2^-24 sqrt(3) of
  // them, which is half of the margin where they are at most twice what that is made of. The way back is covered by the
  // rest.
  bool bounds_follow(Vec3d center, double size) const {
    return transform_.scale * (max_component(abs(center)) + size) <= 2 * extent_;
  }

 private:
  static constexpr double kMargin = 0x1p-21;
  static constexpr double kPlacing = 0x1p-40;

  // What the way from mesh axes rounds by, in units of double's precision: much, where a translation brings back a mesh
  // that lies far from its own origin.
  static double lever(const Instance& instance) {
    return max_component(abs(instance.transform.translation)) +
           double{instance.transform.scale} * magnitude(instance.mesh->bounds());
  }

  const Transform& transform_;
  double extent_;
  double margin_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_
