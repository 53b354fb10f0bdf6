// World axis-aligned bounds of an instance's triangles: what decides where CONSERVATIVE is asked, and part of the
// verdict where EXACT is, so that EXACT never finds more, not even where rounding is all that is left of a triangle.
// Grown by a margin that covers every rounding of the exact tests, the way into mesh axes included.
#ifndef LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_
#define LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_

#include <array>

#include "core/scene/statics/instance.h"

namespace locus {

class PlacedTriangles {
 public:
  // `reach`: the largest coordinate or length of the query that the bounds will be held against; 0 where that test pads
  // by itself.
  explicit PlacedTriangles(const Instance& instance, double reach = 0)
      : instance_(instance),
        extent_(magnitude(instance.bounds) + reach),
        margin_(kMargin * extent_ + kPlacing * lever(instance)) {}

  const Instance& instance() const { return instance_; }
  Aabbf everything() const { return instance_.mesh->tree().bounds(); }

  using Corners = std::array<Vec3d, 3>;
  Corners corners_of(const Triangle& triangle) const {
    const Transform& transform = instance_.transform;
    return {transform.point_to_world(to_double(triangle.a)), transform.point_to_world(to_double(triangle.b)),
            transform.point_to_world(to_double(triangle.c))};
  }

  Aabbd bounds_of_triangle(const Triangle& triangle) const { return bounds_of_corners(corners_of(triangle)); }
  Aabbd bounds_of_corners(const Corners& corners) const {
    Aabbd bounds;
    for (const Vec3d corner : corners) bounds = merge(bounds, corner);
    return grown(bounds, margin_);
  }

  // Whether a query of `size` around `center`, in mesh axes, that has a point in common with a triangle there is
  // certain to meet bounds_of_triangle(): rounding its centre and size to float moves it by less than 2^-24 sqrt(3) of
  // them, which is half of the margin where they are at most twice what that is made of. The way back is covered by the
  // rest.
  bool bounds_follow(Vec3d center, double size) const {
    return instance_.transform.scale * (max_component(abs(center)) + size) <= 2 * extent_;
  }

  // Contains bounds_of_triangle() of every triangle within `box`: its margin is twice as wide.
  Aabbd bounds_of_box(const Aabbf& box) const { return grown(bounds_to_world(instance_.transform, box), 2 * margin_); }

 private:
  static constexpr double kMargin = 0x1p-21;
  static constexpr double kPlacing = 0x1p-40;

  // What the way from mesh axes rounds by, in units of double's precision: much, where a translation brings back a mesh
  // that lies far from its own origin.
  static double lever(const Instance& instance) {
    return max_component(abs(instance.transform.translation)) +
           double{instance.transform.scale} * magnitude(instance.mesh->bounds());
  }

  const Instance& instance_;
  double extent_;
  double margin_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_
