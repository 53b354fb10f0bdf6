// World axis-aligned bounds of an instance's triangles. PlacedTriangles returns the bounds that decide CONSERVATIVE
// queries. LoosePlacedTriangles returns wider bounds, which are part of the verdict of EXACT rays, balls and boxes: the
// exact tests run in mesh axes and floats, and must not report a triangle far from its position in the world.
//
// Both classes are immutable and borrow the instance; any number of threads may use one.
#ifndef LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_
#define LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_

#include <array>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/scene/statics/instance.h"

namespace locus {

// Corners of a triangle in world axes.
using Corners = std::array<Vec3d, 3>;

// Returns the corners of `triangle` in world axes.
inline Corners corners_of(const Transform& transform, const Triangle& triangle) {
  return {transform.point_to_world(to_double(triangle.a)), transform.point_to_world(to_double(triangle.b)),
          transform.point_to_world(to_double(triangle.c))};
}

// Returns the bounds of the corners, grown by `epsilon` on every side.
inline Aabbd grown_around(const Corners& corners, double epsilon) {
  Aabbd bounds;
  LOCUS_DCHECK_GE(epsilon, 0.0);
  for (const Vec3d corner : corners) bounds = merge(bounds, corner);
  return grown(bounds, epsilon);
}

// Tight bounds: of the corners placed in double, grown by about 2^-40 of the magnitudes of the translation and of the
// scaled mesh. Both count, since the translation may cancel the offset of a mesh that lies far from its own origin. The
// bounds lie within Instance::bounds, which are grown by twice as much, so a triangle's bounds alone determine its t,
// distance and point.
class PlacedTriangles {
 public:
  explicit PlacedTriangles(const Instance& instance)
      : transform_(instance.transform),
        epsilon_((planted(PlantedBug::kWidePlacedBounds) ? 0x1p-21 : kRelativeEpsilon) *
                 (max_component(abs(instance.transform.translation)) +
                  4.0 * instance.transform.scale * magnitude(instance.mesh->bounds()))) {}

  Aabbd bounds_of_triangle(const Triangle& triangle) const {
    return bounds_of_corners(corners_of(transform_, triangle));
  }
  Aabbd bounds_of_corners(const Corners& corners) const { return grown_around(corners, epsilon_); }

  // Returns bounds that contain bounds_of_triangle() of every triangle within `box`, a box in mesh axes: grown at least
  // twice as much.
  Aabbd bounds_of_box(const Aabbf& box) const { return grown(bounds_to_world(transform_, box), 2 * epsilon_); }

 private:
  static constexpr double kRelativeEpsilon = 0x1p-41;

  const Transform& transform_;
  double epsilon_;
};

// Wide bounds: of the placed corners, grown by an epsilon that covers all rounding errors of the exact tests, including
// the transformation into mesh axes and one rounding to float there.
class LoosePlacedTriangles {
 public:
  // `query_extent`: the largest coordinate or length of the query that the bounds are tested against; 0 if that test
  // grows the bounds itself.
  explicit LoosePlacedTriangles(const Instance& instance, double query_extent = 0)
      : transform_(instance.transform),
        extent_(magnitude(instance.bounds) + query_extent),
        epsilon_(kRelativeEpsilon * extent_ + kPlacementEpsilon * placement_magnitude(instance)) {
    LOCUS_DCHECK_GE(query_extent, 0.0);
  }

  Aabbd bounds_of_triangle(const Triangle& triangle) const {
    return grown_around(corners_of(transform_, triangle), epsilon_);
  }

  // Returns whether a query of `size` around `center`, in mesh axes, that overlaps a triangle there is certain to
  // overlap bounds_of_triangle() in world axes. Rounding centre and size to float moves the query by less than 2^-24
  // sqrt(3) of their magnitude. If that is at most twice extent_, the error is at most half of epsilon_. The other half
  // covers the transformation back to world axes.
  bool bounds_follow(Vec3d center, double size) const {
    return transform_.scale * (max_component(abs(center)) + size) <= 2 * extent_;
  }

 private:
  static constexpr double kRelativeEpsilon = 0x1p-21;
  static constexpr double kPlacementEpsilon = 0x1p-40;

  // Returns the magnitude that scales the rounding error of placing a vertex. It is large if the translation cancels
  // the offset of a mesh that lies far from its own origin.
  static double placement_magnitude(const Instance& instance) {
    return max_component(abs(instance.transform.translation)) +
           double{instance.transform.scale} * magnitude(instance.mesh->bounds());
  }

  const Transform& transform_;
  double extent_;
  double epsilon_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_
