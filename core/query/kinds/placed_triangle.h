// Axis-aligned bounds of an instance's triangles in world axes. CONSERVATIVE queries test the bounds of
// PlacedTriangles. An EXACT ray, sweep or overlap query finds a triangle only if the query also intersects the wider
// bounds of the triangle, which LoosePlacedTriangles computes. Without this condition, an exact test, which runs in
// mesh axes, could report a triangle that is far away in the world, because of rounding.
//
// Both classes are immutable and borrow the instance; any number of threads may share one object.
#ifndef LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_
#define LOCUS_CORE_QUERY_KINDS_PLACED_TRIANGLE_H_

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/scene/statics/instance.h"

namespace locus {

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

// Tight bounds of the triangles of an instance. The bounds of a triangle are the box around its corners in world axes,
// grown by an epsilon that covers the rounding of the corners, which are transformed in double. The epsilon is about
// 2^-40 times the sum of the magnitudes of the translation and of the scaled mesh. Both magnitudes count, since a mesh
// may be far from its own origin while the translation cancels this offset. The bounds of each triangle lie within
// Instance::bounds, which are grown by twice as much. So culling by Instance::bounds never changes a CONSERVATIVE row:
// its t, distance and point depend only on the triangle's bounds.
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
  // Returns the length by which the bounds of a triangle are grown.
  double epsilon() const { return epsilon_; }

  // Returns bounds in world axes that contain bounds_of_triangle() of every triangle within `box`, which is in mesh
  // axes. The result is grown by twice the epsilon of a triangle's bounds.
  Aabbd bounds_of_box(const Aabbf& box) const { return grown(bounds_to_world(transform_, box), 2 * epsilon_); }

 private:
  static constexpr double kRelativeEpsilon = 0x1p-41;

  const Transform& transform_;
  double epsilon_;
};

// Wide bounds of the triangles of an instance. The bounds of a triangle are the box around its corners in world axes,
// grown by an epsilon that covers all rounding errors of the exact tests. These errors include the errors of the
// transformation into mesh axes and of one rounding to float in mesh axes.
class LoosePlacedTriangles {
 public:
  // `query_extent` is an upper bound of the largest |coordinate| that the query reaches; a larger value enlarges the
  // epsilon. Pass 0 if the caller's test grows the bounds itself.
  explicit LoosePlacedTriangles(const Instance& instance, double query_extent = 0)
      : transform_(instance.transform),
        extent_(magnitude(instance.bounds) + query_extent),
        epsilon_(kRelativeEpsilon * extent_ + kPlacementEpsilon * placement_magnitude(instance)) {
    LOCUS_DCHECK_GE(query_extent, 0.0);
  }

  Aabbd bounds_of_triangle(const Triangle& triangle) const {
    return grown_around(corners_of(transform_, triangle), epsilon_);
  }

  // Returns true if the test against bounds_of_triangle() can be omitted for a query of `size` around `center`, both in
  // mesh axes. In that case, a query that overlaps a triangle in mesh axes is sure to overlap the triangle's bounds in
  // world axes. Rounding center and size to float moves the query by less than 2^-24 * sqrt(3) times their magnitude.
  // If this magnitude, scaled to world axes, is at most 2 * extent_, the error is at most half of epsilon_. The other
  // half covers the transformation back to world axes.
  bool bounds_follow(Vec3d center, double size) const {
    return transform_.scale * (max_component(abs(center)) + size) <= 2 * extent_;
  }

 private:
  static constexpr double kRelativeEpsilon = 0x1p-21;
  static constexpr double kPlacementEpsilon = 0x1p-40;

  // Returns the magnitude that determines the rounding error of a vertex's transformation to world axes: the error is
  // proportional to this magnitude. The result is much larger than the coordinates of the transformed vertex if the
  // mesh is far from its own origin and the translation cancels this offset.
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
