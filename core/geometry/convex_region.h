// Convex regions of space, bounded by planes, and their overlaps with shapes and triangles. A region is given relative
// to an origin in world axes, so that a region far from the world's origin is as precise as a region near it. Every
// region is clipped to the world: the cube of all points whose |coordinates| are at most limits::kMaxCoordinate. Pure
// functions in double; any thread.
//
// A point p is within a plane with the normal n and the offset d if n.p + d >= -e, where e is 2^-40 of the magnitudes
// of n.p and d. So a point that rounding has moved off a plane still counts as on the plane. A region and a solid
// overlap if they share a point by this test. Every overlap also requires that may_overlap() is true for the bounds of
// the shape or triangle, so that culling by any superset of these bounds never changes a result.
// Source: Sutherland, Hodgman, Reentrant Polygon Clipping, 1974.
#ifndef LOCUS_CORE_GEOMETRY_CONVEX_REGION_H_
#define LOCUS_CORE_GEOMETRY_CONVEX_REGION_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absl/types/span.h"
#include "core/base/limits.h"
#include "core/geometry/shape.h"
#include "core/geometry/transform.h"
#include "core/geometry/triangle.h"

namespace locus {

// Half-space of the points p with normal.p + offset >= 0.
struct Plane {
  Vec3d normal;  // unit vector, pointing into the half-space
  double offset = 0;
};

// Returns the plane with the normal and offset divided by the length of the normal, which must not be zero.
Plane normalized_plane(Vec3d normal, double offset);

// Convex region. Invariant: the region has an interior point.
class ConvexRegion {
 public:
  // Makes the region of all points that lie within the world and whose offsets from `origin` lie within all planes.
  // Returns nullopt if the region has no interior point. At most limits::kMaxPlanes planes. O(planes^2).
  static std::optional<ConvexRegion> make(Vec3d origin, absl::Span<const Plane> planes);

  Vec3d origin() const { return origin_; }
  // Returns the planes, relative to origin().
  absl::Span<const Plane> planes() const { return {planes_.data(), count_}; }
  // Returns a point of the interior, relative to origin().
  Vec3d interior() const { return interior_; }
  // Returns bounds of the region in world axes, not tight.
  const Aabbd& bounds() const { return bounds_; }

 private:
  ConvexRegion() = default;

  Vec3d origin_;
  // The given planes, then those sides of the world that the region reaches.
  std::array<Plane, limits::kMaxPlanes + 6> planes_;
  size_t count_ = 0;
  Vec3d interior_;
  Aabbd bounds_;
};

// Returns false if the box lies outside of the region's bounds, or wholly outside of one of the region's planes;
// otherwise true. Monotone: if the result is true for a box, it is true for every box that contains this box.
bool may_overlap(const ConvexRegion& region, const Aabbd& box);

// Returns whether the region shares a point with the shape, a closed solid.
bool region_overlaps(const ConvexRegion& region, const Shape& shape);

// Relation of a ball to a region. For most objects, the relation of a ball around the object already determines whether
// the object overlaps the region, so that its exact shape need not be tested.
enum class RegionSide { kInside, kOutside, kUndecided };
// Let e be the sum of the rounding error and `slack`. Returns kOutside if the ball lies wholly outside of a plane,
// farther than e from it. Returns kInside if the centre of the ball lies within each plane, farther than e from it.
// Otherwise returns kUndecided. `center` is in world axes; `slack` is an upper bound of the error of `center`.
RegionSide side_of_ball(const ConvexRegion& region, Vec3d center, double radius, double slack);

// Set of planes of a region: bit i is plane i.
using PlaneSet = uint64_t;
// Planes of a region that many balls close to each other have to be compared with.
struct NearPlanes {
  bool outside = false;  // side_of_ball() is kOutside for every ball; `planes` has no meaning then
  PlaneSet planes = 0;   // the centres of all balls lie within every plane that is not in this set
};
// Returns the planes for the balls with a centre in the box `centers` and a radius of at most `radius`. `slack` is an
// upper bound of the slack of each ball.
NearPlanes near_planes(const ConvexRegion& region, const Aabbd& centers, double radius, double slack);
// Returns the result of side_of_ball() for one of the balls for which near_planes() returned `planes`, but compares the
// ball only with these planes.
RegionSide side_of_ball(const ConvexRegion& region, PlaneSet planes, Vec3d center, double radius, double slack);

// Planes of a region in the axes of a mesh, and for each plane the distance by which a corner of the mesh may be
// outside of the plane and still count as on it.
class RegionInMesh {
 public:
  // `magnitude` is the largest |coordinate| of the mesh.
  RegionInMesh(const ConvexRegion& region, const Transform& transform, float magnitude);

  // Returns whether the box may overlap the region: false if the box lies wholly outside of one plane, otherwise true.
  bool may_overlap(const Aabbf& box) const;
  // Returns whether the region shares a point with the triangle, a closed surface.
  bool overlaps(const Triangle& triangle) const;

 private:
  std::array<Plane, limits::kMaxPlanes + 6> planes_;
  std::array<double, limits::kMaxPlanes + 6> epsilons_;
  size_t count_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_CONVEX_REGION_H_
