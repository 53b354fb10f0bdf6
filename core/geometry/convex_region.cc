#include "core/geometry/convex_region.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/segment.h"

namespace locus {
namespace {

constexpr double kPlaneEpsilon = 0x1p-40;
// Determinants below this value belong to planes that are parallel up to rounding; such planes are treated as having no
// common line and no common corner.
constexpr double kParallelPlanes = 0x1p-40;

double value_at(const Plane& plane, Vec3d point) { return dot(plane.normal, point) + plane.offset; }

// Returns how far `point` may be outside of the plane and still count as on it.
double epsilon_at(const Plane& plane, Vec3d point) {
  return kPlaneEpsilon * (dot(abs(plane.normal), abs(point)) + std::abs(plane.offset));
}

bool is_within(absl::Span<const Plane> planes, Vec3d point) {
  for (const Plane& plane : planes)
    if (value_at(plane, point) < -epsilon_at(plane, point)) return false;
  return true;
}

// Convex polygon that is clipped by planes. A quadrilateral clipped by n planes has at most 4 + n corners.
class Polygon {
 public:
  static constexpr size_t kMaxCorners = 4 + limits::kMaxPlanes + 6 + 6;

  // Adds a corner. Drops corners beyond kMaxCorners: rounding may make a polygon with many nearly equal corners
  // slightly concave, so that one plane adds more than one corner.
  void add(Vec3d corner) {
    if (count_ < kMaxCorners) corners_[count_++] = corner;
  }
  absl::Span<const Vec3d> corners() const { return {corners_.data(), count_}; }
  bool empty() const { return count_ == 0; }

  // Removes the part outside of the plane. `epsilon(corner)` is how far a corner may be outside of the plane and still
  // count as on it.
  template <class Epsilon>
  void cut(const Plane& plane, const Epsilon& epsilon) {
    std::array<double, kMaxCorners> values;
    bool any = false;
    for (size_t i = 0; i < count_; ++i) {
      values[i] = value_at(plane, corners_[i]);
      if (values[i] < 0 && values[i] >= -epsilon(corners_[i])) values[i] = 0;
      any |= values[i] < 0;
    }
    if (!any) return;
    const Polygon all = *this;
    count_ = 0;
    for (size_t i = 0; i < all.count_; ++i) {
      const size_t next = i + 1 == all.count_ ? 0 : i + 1;
      if (values[i] >= 0) add(all.corners_[i]);
      if ((values[i] > 0 && values[next] < 0) || (values[i] < 0 && values[next] > 0)) {
        const double part = values[i] / (values[i] - values[next]);
        add(all.corners_[i] + (all.corners_[next] - all.corners_[i]) * part);
      }
    }
  }

 private:
  std::array<Vec3d, kMaxCorners> corners_;
  size_t count_ = 0;
};

// Returns a square polygon in the plane: its centre is the projection of `center` to the plane, and its sides have the
// length 2 * size.
Polygon square_on(const Plane& plane, Vec3d center, double size) {
  const Vec3d n = plane.normal, a = abs(n);
  const Vec3d other = a.x <= a.y && a.x <= a.z ? Vec3d{1, 0, 0} : a.y <= a.z ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
  const Vec3d u = normalized(cross(n, other)) * size, v = normalized(cross(n, u)) * size;
  const Vec3d at = center - n * value_at(plane, center);
  Polygon polygon;
  for (const Vec3d corner : {at + u + v, at - u + v, at - u - v, at + u - v}) polygon.add(corner);
  return polygon;
}

// Bounds, sum and number of the corners of all faces of a region. A corner counts once for each of its faces.
struct FaceCorners {
  Aabbd bounds;
  Vec3d sum;
  size_t count = 0;
};

// Returns the corners of all faces. Each face begins as a square of half side `size` around the projection of `center`;
// the square must contain the face. The error of a corner is a few roundings of `size`.
FaceCorners corners_of_faces(absl::Span<const Plane> planes, Vec3d center, double size) {
  FaceCorners corners;
  const auto epsilon = [error = size * 0x1p-45](Vec3d) { return error; };
  for (size_t i = 0; i < planes.size(); ++i) {
    Polygon face = square_on(planes[i], center, size);
    for (size_t k = 0; k < planes.size() && !face.empty(); ++k)
      if (k != i) face.cut(planes[k], epsilon);
    for (const Vec3d corner : face.corners()) {
      corners.bounds = merge(corners.bounds, corner);
      corners.sum = corners.sum + corner;
      ++corners.count;
    }
  }
  return corners;
}

// Search for the point of a region that is nearest to a point or a segment. The candidates lie on the region's faces,
// edges and corners. The nearest point is one of the candidates within all planes, and every candidate within all
// planes is a point of the region.
class NearestSearch {
 public:
  explicit NearestSearch(absl::Span<const Plane> planes) : planes_(planes) {}

  // Returns whether a point of the region is within `distance` of `point`, which lies outside of the region.
  bool within(Vec3d point, double distance) const {
    const auto is_near = [&](Vec3d candidate) {
      const double reach = distance + kPlaneEpsilon * (max_component(abs(candidate)) + distance);
      return squared_length(candidate - point) <= reach * reach && is_within(planes_, candidate);
    };
    for (size_t a = 0; a < planes_.size(); ++a) {
      const double va = value_at(planes_[a], point);
      if (va >= 0) continue;  // the nearest point lies on a plane that `point` is outside of
      if (is_near(point - planes_[a].normal * va)) return true;
      for (size_t b = 0; b < planes_.size(); ++b)
        if (b != a && (edge_within(a, b, point, is_near) || corners_within(a, b, point, is_near))) return true;
    }
    return false;
  }

  // Returns whether a point of the region is within `distance` of an inner point of the segment from center - half_axis
  // to center + half_axis. The segment must lie outside of the region. The ends of the segment are not tested.
  bool within_of_segment(Vec3d center, Vec3d half_axis, double distance) const {
    const auto is_near = [&](Vec3d candidate) {
      const double reach = distance + kPlaneEpsilon * (max_component(abs(candidate)) + distance);
      return squared_distance_to_segment(candidate - center, half_axis) <= reach * reach &&
             is_within(planes_, candidate);
    };
    for (size_t a = 0; a < planes_.size(); ++a)
      for (size_t b = 0; b < a; ++b)
        if (segment_edge_within(a, b, center, half_axis, is_near) || corners_within(a, b, center, is_near)) return true;
    return false;
  }

 private:
  // Tests the projection of `point` to the common line of two planes.
  template <class IsNear>
  bool edge_within(size_t a, size_t b, Vec3d point, const IsNear& is_near) const {
    const double g = dot(planes_[a].normal, planes_[b].normal), determinant = 1 - g * g;
    if (determinant < kParallelPlanes) return false;
    const double va = value_at(planes_[a], point), vb = value_at(planes_[b], point);
    return is_near(point - planes_[a].normal * ((va - g * vb) / determinant) -
                   planes_[b].normal * ((vb - g * va) / determinant));
  }

  // Tests the common points of the planes `a` and `b` with each plane after `b`.
  template <class IsNear>
  bool corners_within(size_t a, size_t b, Vec3d point, const IsNear& is_near) const {
    const Plane &first = planes_[a], &second = planes_[b];
    const Vec3d line = cross(first.normal, second.normal);
    for (size_t c = b + 1; c < planes_.size(); ++c) {
      if (c == a) continue;
      const Plane& third = planes_[c];
      const double determinant = dot(line, third.normal);
      if (std::abs(determinant) < kParallelPlanes) continue;
      const Vec3d sum = cross(second.normal, third.normal) * value_at(first, point) +
                        cross(third.normal, first.normal) * value_at(second, point) + line * value_at(third, point);
      if (is_near(point - sum * (1 / determinant))) return true;
    }
    return false;
  }

  // Tests the point of the common line of two planes that is nearest to the segment's line.
  template <class IsNear>
  bool segment_edge_within(size_t a, size_t b, Vec3d center, Vec3d half_axis, const IsNear& is_near) const {
    const Plane &first = planes_[a], &second = planes_[b];
    const double g = dot(first.normal, second.normal), determinant = 1 - g * g;
    if (determinant < kParallelPlanes) return false;
    const double va = value_at(first, center), vb = value_at(second, center);
    // `offset`: from the centre to the nearest point of the planes' common line; `line`: direction of this line.
    const Vec3d offset =
        -(first.normal * ((va - g * vb) / determinant) + second.normal * ((vb - g * va) / determinant));
    const Vec3d line = cross(first.normal, second.normal);
    const double along = dot(line, half_axis), area = squared_length(line) * squared_length(half_axis) - along * along;
    if (!(area > 0)) return false;
    // `offset` is perpendicular to the common line, whose point nearest to the segment's line is offset + line * s.
    const double s = along * dot(offset, half_axis) / area;
    return is_near(center + offset + line * s);
  }

  absl::Span<const Plane> planes_;
};

bool point_overlaps(const ConvexRegion& region, Vec3d point) { return is_within(region.planes(), point); }

bool ball_overlaps(const ConvexRegion& region, Vec3d center, double radius) {
  return point_overlaps(region, center) || NearestSearch(region.planes()).within(center, radius);
}

// Returns whether a part of the segment lies within all planes.
bool segment_overlaps(absl::Span<const Plane> planes, Vec3d from, Vec3d to) {
  double begin = 0, end = 1;
  for (const Plane& plane : planes) {
    double a = value_at(plane, from), b = value_at(plane, to);
    if (a < 0 && a >= -epsilon_at(plane, from)) a = 0;
    if (b < 0 && b >= -epsilon_at(plane, to)) b = 0;
    if (a < 0 && b < 0) return false;
    if (a < 0) begin = std::max(begin, a / (a - b));
    if (b < 0) end = std::min(end, a / (a - b));
  }
  return begin <= end;
}

bool capsule_overlaps(const ConvexRegion& region, Vec3d center, Vec3d half_axis, double radius) {
  const Vec3d from = center - half_axis, to = center + half_axis;
  return segment_overlaps(region.planes(), from, to) || ball_overlaps(region, from, radius) ||
         ball_overlaps(region, to, radius) ||
         NearestSearch(region.planes()).within_of_segment(center, half_axis, radius);
}

// Returns whether a part of the polygon lies within all planes.
template <class Epsilon>
bool polygon_overlaps(absl::Span<const Plane> planes, Polygon polygon, const Epsilon& epsilon) {
  for (const Plane& plane : planes) {
    polygon.cut(plane, [&](Vec3d corner) { return epsilon(plane, corner); });
    if (polygon.empty()) return false;
  }
  return true;
}

bool box_overlaps(const ConvexRegion& region, Vec3d center, Vec3d half, const Rotation& rotation) {
  if (point_overlaps(region, center)) return true;
  const auto corner = [&](int axis, double side, double u, double v) {
    Vec3d local;
    local[axis] = side * half[axis];
    local[(axis + 1) % 3] = u * half[(axis + 1) % 3];
    local[(axis + 2) % 3] = v * half[(axis + 2) % 3];
    return center + rotation.to_world(local);
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      Polygon face;
      for (const auto& [u, v] : {std::array{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
        face.add(corner(axis, side, u, v));
      if (polygon_overlaps(region.planes(), face, epsilon_at)) return true;
    }
  }
  // The region may lie wholly inside of the box.
  const Vec3d inside = abs(rotation.to_local(region.interior() - center));
  return inside.x <= half.x && inside.y <= half.y && inside.z <= half.z;
}

}  // namespace

Plane normalized_plane(Vec3d normal, double offset) {
  const double scale = max_component(abs(normal));
  LOCUS_DCHECK_GT(scale, 0.0);
  const Vec3d scaled = {normal.x / scale, normal.y / scale, normal.z / scale};
  const double length = std::sqrt(squared_length(scaled));
  return {{scaled.x / length, scaled.y / length, scaled.z / length}, offset / scale / length};
}

std::optional<ConvexRegion> ConvexRegion::make(Vec3d origin, absl::Span<const Plane> planes) {
  LOCUS_DCHECK_LE(planes.size(), size_t{limits::kMaxPlanes});
  ConvexRegion region;
  region.origin_ = origin;
  std::copy(planes.begin(), planes.end(), region.planes_.begin());
  region.count_ = planes.size();
  // Adds the six sides of the world as planes.
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      Plane& plane = region.planes_[region.count_++];
      plane.normal[axis] = -side;
      plane.offset = limits::kMaxCoordinate - side * origin[axis];
    }
  }
  // Computes the faces twice: first from squares as large as the world, which results in errors of micrometres at the
  // corners, then from squares as large as the region.
  const FaceCorners rough = corners_of_faces(region.planes(), Vec3d{} - origin, 4 * limits::kMaxCoordinate);
  if (rough.count == 0) return std::nullopt;
  const Vec3d center = (rough.bounds.min + rough.bounds.max) * 0.5;
  const double size = 2 * max_component(rough.bounds.max - rough.bounds.min) + 1e-3;
  const FaceCorners fine = corners_of_faces(region.planes(), center, size);
  if (fine.count == 0) return std::nullopt;
  region.interior_ = fine.sum * (1.0 / static_cast<double>(fine.count));
  for (const Plane& plane : region.planes())
    if (!(value_at(plane, region.interior_) > epsilon_at(plane, region.interior_))) return std::nullopt;
  const double growth = 0x1p-30 * (size + max_component(abs(center))) + 0x1p-40 * max_component(abs(origin));
  region.bounds_ = grown(Aabbd{fine.bounds.min + origin, fine.bounds.max + origin}, growth);
  // A side of the world need not be tested if the region does not reach it.
  size_t kept = planes.size();
  for (size_t i = planes.size(); i < region.count_; ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3d at{(corner & 1) != 0 ? region.bounds_.max.x : region.bounds_.min.x,
                     (corner & 2) != 0 ? region.bounds_.max.y : region.bounds_.min.y,
                     (corner & 4) != 0 ? region.bounds_.max.z : region.bounds_.min.z};
      least = std::min(least, value_at(region.planes_[i], at - origin));
    }
    if (least <= 0) region.planes_[kept++] = region.planes_[i];
  }
  region.count_ = kept;
  return region;
}

bool may_overlap(const ConvexRegion& region, const Aabbd& box) {
  if (!overlaps(region.bounds(), box)) return false;
  const Vec3d low = box.min - region.origin(), high = box.max - region.origin();
  const Vec3d largest = max(abs(low), abs(high));
  // The coordinates of the box are rounded in world axes, so their errors do not shrink near the region's origin.
  const double rounding = 0x1p-48 * magnitude(box);
  for (const Plane& plane : region.planes()) {
    const Vec3d n = plane.normal;
    const double value = n.x * (n.x > 0 ? high.x : low.x) + n.y * (n.y > 0 ? high.y : low.y) +
                         n.z * (n.z > 0 ? high.z : low.z) + plane.offset;
    if (value < -(epsilon_at(plane, largest) + rounding)) return false;
  }
  return true;
}

bool region_overlaps(const ConvexRegion& region, const Shape& shape) {
  if (!may_overlap(region, bounds_of(shape))) return false;
  const Vec3d center = shape.position - region.origin();
  switch (shape.kind) {
    case ShapeKind::kPoint:
      return point_overlaps(region, center);
    case ShapeKind::kBall:
      return ball_overlaps(region, center, double{shape.radius});
    case ShapeKind::kBox:
      return box_overlaps(region, center, to_double(shape.size), rotation_of(shape.rotation));
    case ShapeKind::kCapsule:
      return capsule_overlaps(region, center, rotation_of(shape.rotation).to_world(to_double(shape.size)),
                              double{shape.radius});
    case ShapeKind::kCompound:
      break;
  }
  return false;
}

NearPlanes near_planes(const ConvexRegion& region, const Aabbd& centers, double radius, double slack) {
  static_assert(limits::kMaxPlanes + 6 < 64, "a PlaneSet has a bit for each plane");
  const Vec3d middle = (centers.min + centers.max) * 0.5 - region.origin(), half = (centers.max - centers.min) * 0.5;
  // The errors of `middle` and `half` are relative to the coordinates of the box in world axes, whence the last term.
  const double largest = max_component(abs(middle)) + max_component(half) + 0x1p-12 * magnitude(centers);
  NearPlanes near;
  for (size_t i = 0; i < region.planes().size(); ++i) {
    const Plane& plane = region.planes()[i];
    const double value = value_at(plane, middle);
    const double reach = planted(PlantedBug::kRegionBrickReach) ? 0 : dot(abs(plane.normal), half);
    // Twice the error of side_of_ball(), since `value` and `reach` have rounding errors of their own.
    const double error = 2 * slack + 8 * kPlaneEpsilon * (3 * largest + std::abs(plane.offset) + radius);
    near.outside |= value + reach < -(radius + error);
    if (!(value - reach > error)) near.planes |= PlaneSet{1} << i;
  }
  return near;
}

RegionSide side_of_ball(const ConvexRegion& region, PlaneSet planes, Vec3d center, double radius, double slack) {
  const Vec3d local = center - region.origin();
  const double size = 3 * max_component(abs(local)) + radius;
  bool inside = true;
  for (; planes != 0; planes &= planes - 1) {
    const Plane& plane = region.planes()[static_cast<size_t>(__builtin_ctzll(planes))];
    const double value = value_at(plane, local);
    const double error = slack + 4 * kPlaneEpsilon * (size + std::abs(plane.offset));
    if (value < -(radius + error)) return RegionSide::kOutside;
    inside &= value > error;
  }
  return inside ? RegionSide::kInside : RegionSide::kUndecided;
}

RegionSide side_of_ball(const ConvexRegion& region, Vec3d center, double radius, double slack) {
  return side_of_ball(region, (PlaneSet{1} << region.planes().size()) - 1, center, radius, slack);
}

RegionInMesh::RegionInMesh(const ConvexRegion& region, const Transform& transform, float magnitude) {
  const Vec3d from = transform.translation - region.origin();
  for (const Plane& plane : region.planes()) {
    Plane& local = planes_[count_];
    local.normal = transform.rotation.to_local(plane.normal);
    local.offset = value_at(plane, from) / double{transform.scale};
    // The offset is a sum, and its rounding error is proportional to the magnitudes of the terms of this sum.
    const double terms = (dot(abs(plane.normal), abs(from)) + std::abs(plane.offset)) / double{transform.scale};
    epsilons_[count_++] = kPlaneEpsilon * (3 * double{magnitude} + terms);
  }
}

bool RegionInMesh::may_overlap(const Aabbf& box) const {
  const Vec3d low = to_double(box.min), high = to_double(box.max);
  for (size_t i = 0; i < count_; ++i) {
    const Vec3d n = planes_[i].normal;
    const double value = n.x * (n.x > 0 ? high.x : low.x) + n.y * (n.y > 0 ? high.y : low.y) +
                         n.z * (n.z > 0 ? high.z : low.z) + planes_[i].offset;
    if (value < -epsilons_[i]) return false;
  }
  return true;
}

bool RegionInMesh::overlaps(const Triangle& triangle) const {
  // The tree culls a box that lies wholly outside of one plane. The same test of the triangle's own bounds makes the
  // result independent of this culling.
  if (!may_overlap(bounds_of(triangle))) return false;
  Polygon polygon;
  for (const Vec3d corner : corners_of(triangle)) polygon.add(corner);
  for (size_t i = 0; i < count_; ++i) {
    polygon.cut(planes_[i], [this, i](Vec3d) { return epsilons_[i]; });
    if (polygon.empty()) return false;
  }
  return true;
}

}  // namespace locus
