#include "core/geometry/box_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/container/inlined_vector.h"
#include "absl/types/span.h"
#include "core/geometry/aabb.h"
#include "core/geometry/point_triangle.h"

namespace locus {
namespace {

constexpr double kReachError = 0x1p-46;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Vec3d unit(int axis) {
  Vec3d vector;
  vector[axis] = 1;
  return vector;
}

// Separating axis tests of one motion. Accumulates the intersection of the intervals of time of all axes added so far.
class AxisTests {
 public:
  AxisTests(Vec3d half, Vec3d velocity) : half_(half), velocity_(velocity) {}

  // Adds an axis on which the moving polytope projects to low .. high at t = 0. `magnitude` is about the largest
  // |component| of the polytope's points. Returns false if at every time at least one of the axes added so far
  // separates the polytopes.
  bool add(Vec3d axis, double low, double high, double magnitude) {
    const Vec3d size = abs(axis);
    const double weight = size.x + size.y + size.z;
    if (weight == 0) return true;
    const double speed = dot(axis, velocity_);
    const double reach = dot(size, half_) + kReachError * weight * (magnitude + max_component(half_));
    if (low <= reach && high >= -reach) {
      add_way_out(axis, std::min(reach - low, high + reach), reach - low < high + reach);
    } else {
      outside_ = true;
    }
    if (speed == 0) return low <= reach && high >= -reach;
    const double enter = speed > 0 ? (-reach - high) / speed : (reach - low) / speed;
    const double leave = speed > 0 ? (reach - low) / speed : (-reach - high) / speed;
    if (enter > overlap_.time.near) {
      overlap_.time.near = enter;
      entry_axis_ = axis * (speed > 0 ? 1.0 : -1.0);
    }
    overlap_.time.far = std::min(overlap_.time.far, leave);
    return overlap_.time.near <= overlap_.time.far;
  }

  BoxOverlap finish() {
    if (outside_) overlap_.normal = normalized(entry_axis_);
    return overlap_;
  }

 private:
  // Records the way out of the overlap along `axis` if it is the shortest so far. On this way the resting box moves by
  // exit / |axis|, along -axis if the polytope is above the box on this axis, else along `axis`.
  void add_way_out(Vec3d axis, double exit, bool polytope_above) {
    const double length = std::sqrt(squared_length(axis));
    // Compares exit / length with depth_ without a division: the cross product of nearly parallel edges is an axis
    // whose length may be near 0.
    if (!(exit < depth_ * length)) return;
    depth_ = exit / length;
    overlap_.depth = depth_;
    overlap_.normal = axis * ((polytope_above ? -1 : 1) / length);
  }

  const Vec3d half_, velocity_;
  BoxOverlap overlap_{{-kInfinity, kInfinity}, {}, 0};
  Vec3d entry_axis_;
  double depth_ = kInfinity;
  bool outside_ = false;
};

using CutFace = absl::InlinedVector<Vec3d, 12>;

// Returns the part of a convex polygon with sign * p[axis] <= limit.
CutFace clipped(const CutFace& polygon, int axis, double sign, double limit) {
  CutFace result;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec3d from = polygon[i], to = polygon[(i + 1) % polygon.size()];
    const double a = sign * from[axis] - limit, b = sign * to[axis] - limit;
    if (a <= 0) result.push_back(from);
    if ((a < 0 && b > 0) || (a > 0 && b < 0)) result.push_back(from + (to - from) * (a / (a - b)));
  }
  return result;
}

// Returns the mean of the corners of the part of the polygon inside the box; nullopt if no part is inside.
std::optional<Vec3d> mean_inside(CutFace polygon, Vec3d half) {
  for (int axis = 0; axis < 3; ++axis) {
    polygon = clipped(polygon, axis, 1, half[axis]);
    polygon = clipped(polygon, axis, -1, half[axis]);
  }
  if (polygon.empty()) return std::nullopt;
  Vec3d sum;
  for (const Vec3d corner : polygon) sum = sum + corner;
  return sum * (1.0 / static_cast<double>(polygon.size()));
}

Vec3d widened(Vec3d half, double magnitude) {
  const double by = 0x1p-36 * (max_component(half) + magnitude);
  return half + Vec3d{by, by, by};
}

}  // namespace

std::optional<BoxOverlap> overlap_with_triangle(Vec3d half, Vec3d a, Vec3d b, Vec3d c, Vec3d velocity) {
  AxisTests tests(half, velocity);
  const double magnitude = max_component(max(max(abs(a), abs(b)), abs(c)));
  const auto add = [&](Vec3d axis) {
    const double pa = dot(axis, a), pb = dot(axis, b), pc = dot(axis, c);
    return tests.add(axis, std::min({pa, pb, pc}), std::max({pa, pb, pc}), magnitude);
  };
  for (int i = 0; i < 3; ++i)
    if (!add(unit(i))) return std::nullopt;
  const Vec3d edges[] = {b - a, c - b, a - c};
  if (!add(cross(edges[0], edges[1]))) return std::nullopt;
  for (const Vec3d edge : edges)
    for (int i = 0; i < 3; ++i)
      if (!add(cross(edge, unit(i)))) return std::nullopt;
  return tests.finish();
}

std::optional<BoxOverlap> overlap_with_box(Vec3d half, Vec3d center, Vec3d other_half, const Rotation& rotation,
                                           Vec3d velocity) {
  AxisTests tests(half, velocity);
  const double magnitude = max_component(abs(center)) + max_component(other_half);
  const auto add = [&](Vec3d axis) {
    const double middle = dot(axis, center), reach = dot(abs(rotation.to_local(axis)), other_half);
    return tests.add(axis, middle - reach, middle + reach, magnitude);
  };
  for (int i = 0; i < 3; ++i)
    if (!add(unit(i)) || !add(rotation.column(i))) return std::nullopt;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      if (!add(cross(rotation.column(i), unit(k)))) return std::nullopt;
  return tests.finish();
}

Vec3d shared_point(Vec3d half, Vec3d a, Vec3d b, Vec3d c) {
  const double magnitude = max_component(max(max(abs(a), abs(b)), abs(c)));
  return mean_inside({a, b, c}, widened(half, magnitude)).value_or(nearest_on_triangle({}, a, b, c));
}

Vec3d shared_point(Vec3d half, Vec3d center, Vec3d other_half, const Rotation& rotation) {
  const Vec3d wide = widened(half, max_component(abs(center)) + max_component(other_half));
  Vec3d sum;
  int faces = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      CutFace face;
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (const auto& [su, sv] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}) {
        Vec3d corner;
        corner[axis] = sign * other_half[axis];
        corner[u] = su * other_half[u];
        corner[v] = sv * other_half[v];
        face.push_back(center + rotation.to_world(corner));
      }
      const std::optional<Vec3d> point = mean_inside(face, wide);
      if (!point) continue;
      sum = sum + *point;
      ++faces;
    }
  }
  // If no face of the other box reaches into this box, the boxes are separate or this box lies inside the other box.
  if (faces != 0) return sum * (1.0 / faces);
  return center + rotation.to_world(nearest_in(rotation.to_local(-center), Aabbd{-other_half, other_half}));
}

}  // namespace locus
