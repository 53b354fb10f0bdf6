// Overlap of a moving ball, capsule or box with a triangle, by search in long double. The search finds the least
// distance, because the distance of two convex solids is a convex function of time. Used by the proof that no sweep
// misses. Shares only vectors with the product.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_REAL_SWEEP_H_
#define LOCUS_TESTS_SUPPORT_PROOF_REAL_SWEEP_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/geometry/mover.h"
#include "tests/support/proof/real_triangle.h"

namespace locus::test {

using RealCorners = std::array<Vec3r, 3>;

// A mover in long double, in world axes. A ball is a capsule whose half axis is zero.
struct RealMover {
  MoverKind kind = MoverKind::kBall;
  Vec3r start, way;
  Real radius = 0;
  Vec3r half_axis;
  Vec3r half;                      // box
  std::array<Vec3r, 3> axes = {};  // box: its own axes, unit vectors

  Real size() const { return kind == MoverKind::kBox ? length(half) : radius + length(half_axis); }
};

// Returns the distance of the segments p + s d and q + t e, 0 <= s, t <= 1. The nearest points are an end of one
// segment and any point of the other, or an inner point of each.
inline Real segment_distance(Vec3r p, Vec3r d, Vec3r q, Vec3r e) {
  const auto to_point = [](Vec3r from, Vec3r along, Vec3r point) {
    const Real square = dot(along, along);
    const Real s = square == 0 ? 0 : std::clamp<Real>(dot(point - from, along) / square, 0, 1);
    return length(point - from - along * s);
  };
  Real least = std::min({to_point(p, d, q), to_point(p, d, q + e), to_point(q, e, p), to_point(q, e, p + d)});
  const Real dd = dot(d, d), ee = dot(e, e), de = dot(d, e), determinant = dd * ee - de * de;
  if (determinant <= 0) return least;
  const Vec3r r = q - p;
  const Real s = (dot(r, d) * ee - dot(r, e) * de) / determinant, t = (dot(r, d) * de - dot(r, e) * dd) / determinant;
  if (s >= 0 && s <= 1 && t >= 0 && t <= 1) least = std::min(least, length(p + d * s - q - e * t));
  return least;
}

// A triangle in world axes that movers may hit.
class SweptTriangle {
 public:
  explicit SweptTriangle(const RealCorners& corners)
      : corners_(corners), triangle_(corners[0], corners[1], corners[2]) {
    center_ = (corners_[0] + corners_[1] + corners_[2]) * (1.0L / 3);
    for (const Vec3r& corner : corners_) radius_ = std::max(radius_, length(corner - center_));
  }

  // Returns true if the mover, grown by `by`, touches the ball around the triangle at some time of the mover's motion.
  // Sometimes also returns true if the mover passes near this ball.
  bool is_near(const RealMover& mover, Real by) const {
    const Real square = dot(mover.way, mover.way);
    const Real t = square == 0 ? 0 : std::clamp<Real>(dot(center_ - mover.start, mover.way) / square, 0, 1);
    return length(mover.start + mover.way * t - center_) <= radius_ + mover.size() + 2 * by;
  }

  // Returns a lower bound of the distance between the triangle and the mover at time t, where the mover is grown by
  // `by` on every side. The bound is at most zero if the triangle and the mover share a point, otherwise positive. It
  // is convex in t.
  Real gap(const RealMover& mover, Real t, Real by) const {
    const Vec3r center = mover.start + mover.way * t;
    return mover.kind == MoverKind::kBox ? box_gap(mover, center, by) : capsule_gap(mover, center) - mover.radius - by;
  }

  // Returns whether the mover, grown by `by`, overlaps the triangle at a time in 0 .. end. Searches for the smallest
  // gap by golden section. Stops as soon as a gap is at most zero, or is larger than the distance that the mover covers
  // in the remaining interval of time.
  bool is_overlapped(const RealMover& mover, Real by, Real end) const {
    constexpr Real kGolden = 0.61803398874989484820L;
    const bool is_box = mover.kind == MoverKind::kBox;
    if ((is_box ? std::min({mover.half.x, mover.half.y, mover.half.z}) : mover.radius) + by < 0 || end < 0)
      return false;
    const Real speed = length(mover.way);
    Real low = 0, high = end;
    Real a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    Real at_a = gap(mover, a, by), at_b = gap(mover, b, by);
    for (int step = 0; step < 60; ++step) {
      if (std::min(at_a, at_b) <= 0) return true;
      if (std::min(at_a, at_b) > speed * (high - low)) return false;
      if (at_a <= at_b) {
        high = b;
        b = a;
        at_b = at_a;
        a = high - kGolden * (high - low);
        at_a = gap(mover, a, by);
      } else {
        low = a;
        a = b;
        at_a = at_b;
        b = low + kGolden * (high - low);
        at_b = gap(mover, b, by);
      }
    }
    return gap(mover, 0, by) <= 0 || gap(mover, end, by) <= 0;
  }

 private:
  Real capsule_gap(const RealMover& mover, Vec3r center) const {
    if (mover.half_axis == Vec3r{}) return triangle_.distance(center);
    const Vec3r from = center - mover.half_axis, along = mover.half_axis * 2;
    const std::optional<Meeting> meeting = triangle_.meet({from, along}, 1);
    if (meeting && meeting->inset >= 0) return 0;
    Real least = std::min(triangle_.distance(from), triangle_.distance(from + along));
    for (size_t i = 0; i < 3; ++i)
      least = std::min(least, segment_distance(from, along, corners_[i], corners_[(i + 1) % 3] - corners_[i]));
    return least;
  }

  // Returns the largest gap between the projections of the box and of the triangle on the axes that can separate them.
  Real box_gap(const RealMover& mover, Vec3r center, Real by) const {
    Real largest = -std::numeric_limits<Real>::infinity();
    const auto project = [&](Vec3r axis) {
      const Real square = dot(axis, axis);
      if (square == 0) return;
      Real low = std::numeric_limits<Real>::infinity(), high = -low, reach = 0;
      for (const Vec3r& corner : corners_) {
        const Real at = dot(corner - center, axis);
        low = std::min(low, at);
        high = std::max(high, at);
      }
      for (int i = 0; i < 3; ++i)
        reach += (mover.half[i] + by) * std::fabs(dot(mover.axes[static_cast<size_t>(i)], axis));
      largest = std::max(largest, std::max(low - reach, -high - reach) / std::sqrt(square));
    };
    const Vec3r edges[3] = {corners_[1] - corners_[0], corners_[2] - corners_[1], corners_[0] - corners_[2]};
    for (const Vec3r& axis : mover.axes) project(axis);
    project(cross(edges[0], edges[1]));
    for (const Vec3r& axis : mover.axes)
      for (const Vec3r& edge : edges) project(cross(axis, edge));
    return largest;
  }

  RealCorners corners_;
  RealTriangle triangle_;
  Vec3r center_;
  Real radius_ = 0;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_REAL_SWEEP_H_
