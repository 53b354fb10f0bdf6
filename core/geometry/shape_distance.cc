#include "core/geometry/shape_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/segment.h"

namespace locus {
namespace {

// Solid of all points within `radius` of a core around the origin. The core is a box if is_box is true, otherwise the
// segment from -half_axis to half_axis.
struct RoundedCore {
  bool is_box = false;
  Vec3d half_axis;  // in world axes
  Vec3d half;       // along the axes of `rotation`
  Rotation rotation;
  double radius = 0;
};

RoundedCore core_of(const Shape& shape) {
  RoundedCore core;
  switch (shape.kind) {
    case ShapeKind::kPoint:
    case ShapeKind::kCompound:
      break;
    case ShapeKind::kBall:
      core.radius = double{shape.radius};
      break;
    case ShapeKind::kCapsule:
      core.half_axis = rotation_of(shape.rotation).to_world(to_double(shape.size));
      core.radius = double{shape.radius};
      break;
    case ShapeKind::kBox:
      core.is_box = true;
      core.half = to_double(shape.size);
      core.rotation = rotation_of(shape.rotation);
      break;
  }
  return core;
}

// Returns corner `i`, 0 .. 7, of a box around the origin, in world axes.
Vec3d corner_of(const RoundedCore& box, int i) {
  return box.rotation.to_world({(i & 1) != 0 ? box.half.x : -box.half.x, (i & 2) != 0 ? box.half.y : -box.half.y,
                                (i & 4) != 0 ? box.half.z : -box.half.z});
}

// Returns the squared distance from a point to a box around the origin.
double squared_distance_to_box(Vec3d point, const RoundedCore& box) {
  const Vec3d gap = max(abs(box.rotation.to_local(point)) - box.half, Vec3d{});
  return squared_length(gap);
}

// Returns the squared distance between two boxes that share no point. The nearest points are either a corner of one
// box and a point of the other box, or a point on an edge of each box. `offset` is the vector from the centre of `a`
// to the centre of `b`.
double squared_distance_apart(const RoundedCore& a, const RoundedCore& b, Vec3d offset) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8; ++i) {
    least = std::min(least, squared_distance_to_box(offset + corner_of(b, i), a));
    least = std::min(least, squared_distance_to_box(corner_of(a, i) - offset, b));
  }
  const auto edge = [](const RoundedCore& box, int i, Vec3d* middle, Vec3d* half) {
    // Edge `i`, 0 .. 11: four along each axis.
    const int axis = i / 4, u = (axis + 1) % 3, v = (axis + 2) % 3;
    Vec3d at, along;
    at[u] = (i & 1) != 0 ? box.half[u] : -box.half[u];
    at[v] = (i & 2) != 0 ? box.half[v] : -box.half[v];
    along[axis] = box.half[axis];
    *middle = box.rotation.to_world(at);
    *half = box.rotation.to_world(along);
  };
  for (int i = 0; i < 12; ++i) {
    Vec3d middle, half;
    edge(a, i, &middle, &half);
    for (int k = 0; k < 12; ++k) {
      Vec3d other_middle, other_half;
      edge(b, k, &other_middle, &other_half);
      least = std::min(least, squared_distance_segments(offset + other_middle - middle, half, other_half));
    }
  }
  return least;
}

// Returns the squared distance between the cores; `offset` is the vector from the centre of `a` to the centre of `b`.
double squared_distance_of_cores(const RoundedCore& a, const RoundedCore& b, Vec3d offset) {
  if (!a.is_box && !b.is_box) return squared_distance_segments(offset, a.half_axis, b.half_axis);
  if (a.is_box && !b.is_box)
    return squared_distance_segment_box(a.rotation.to_local(offset), a.rotation.to_local(b.half_axis), a.half);
  if (!a.is_box)
    return squared_distance_segment_box(b.rotation.to_local(-offset), b.rotation.to_local(a.half_axis), b.half);
  if (boxes_overlap(Obbd{{}, a.half, a.rotation}, Obbd{offset, b.half, b.rotation})) return 0;
  return squared_distance_apart(a, b, offset);
}

bool is_ball_or_point(const Shape& shape) { return shape.kind == ShapeKind::kPoint || shape.kind == ShapeKind::kBall; }

// Returns the distance between two balls or points, bit for bit as the general code of distance_between() computes it,
// but faster: the cores have length 0, so the squared distance of the centres suffices. A point is no ball of radius 0:
// the bounds of a ball are grown, those of a point are not.
double distance_of_balls(const Shape& a, const Shape& b) {
  if (a.kind == ShapeKind::kBall && b.kind == ShapeKind::kBall)
    return distance_between(Balld{a.position, double{a.radius}}, Balld{b.position, double{b.radius}});
  const auto radius = [](const Shape& shape) { return shape.kind == ShapeKind::kBall ? double{shape.radius} : 0.0; };
  const double apart = std::sqrt(squared_length(b.position - a.position)) - radius(a) - radius(b);
  return std::max(apart, distance_between(bounds_of(a), bounds_of(b)));
}

}  // namespace

double distance_between(const Aabbd& a, const Aabbd& b) {
  return std::sqrt(squared_length(max(max(a.min - b.max, b.min - a.max), Vec3d{})));
}

double distance_between(const Shape& a, const Shape& b) {
  if (is_ball_or_point(a) && is_ball_or_point(b)) return distance_of_balls(a, b);
  const RoundedCore first = core_of(a), second = core_of(b);
  const double apart = std::sqrt(squared_distance_of_cores(first, second, b.position - a.position));
  return std::max(apart - first.radius - second.radius, distance_between(bounds_of(a), bounds_of(b)));
}

double least_along(Vec3d direction, const Shape& shape) {
  const RoundedCore core = core_of(shape);
  const double center = dot(direction, shape.position);
  if (core.is_box) return center - dot(abs(core.rotation.to_local(direction)), core.half);
  return center - std::abs(dot(direction, core.half_axis)) - core.radius;
}

double least_along(Vec3d direction, const Corners& corners) {
  return std::min({dot(direction, corners[0]), dot(direction, corners[1]), dot(direction, corners[2])});
}

double least_along(Vec3d direction, const Aabbd& box) {
  const auto along = [&](int axis) { return direction[axis] * (direction[axis] > 0 ? box.min[axis] : box.max[axis]); };
  return along(0) + along(1) + along(2);
}

}  // namespace locus
