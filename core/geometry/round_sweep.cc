#include "core/geometry/round_sweep.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/base/planted_bug.h"

namespace locus {
namespace {

// Epsilons of touches(): kPlaceEpsilon is relative to sizes and positions at the tested time, kWayEpsilon to the length
// of the path covered until this time.
constexpr double kPlaceEpsilon = 0x1p-44, kWayEpsilon = 0x1p-48;
// Limit of the steps of Newton's method. For a grazing contact, each step halves the remaining time, so the epsilon is
// reached after about kMaxSteps / 2 steps.
constexpr int kMaxSteps = 64;

double size_of(Vec3d v) { return max_component(abs(v)); }

// Returns the unit vector of `direction` or of -`direction`, whichever points against `motion`. A zero `direction` is
// replaced by -`motion` or, if that is zero too, by the z axis.
Vec3d against(Vec3d direction, Vec3d motion) {
  if (direction == Vec3d{}) return motion == Vec3d{} ? Vec3d{0, 0, 1} : normalized(-motion);
  return normalized(dot(direction, motion) > 0 ? -direction : direction);
}

}  // namespace

RoundSweep RoundSweep::to_segment(Vec3d half_axis, double radius, Vec3d center, Vec3d other_half_axis, Vec3d velocity) {
  RoundSweep sweep(Primitive::kSegment, half_axis, radius, velocity);
  sweep.a_ = center;
  sweep.b_ = other_half_axis;
  sweep.size_ = size_of(half_axis) + size_of(other_half_axis);
  return sweep;
}

RoundSweep RoundSweep::to_triangle(Vec3d half_axis, double radius, Vec3d a, Vec3d b, Vec3d c, Vec3d velocity) {
  RoundSweep sweep(Primitive::kTriangle, half_axis, radius, velocity);
  sweep.a_ = a;
  sweep.b_ = b;
  sweep.c_ = c;
  sweep.size_ = size_of(half_axis) + std::max(size_of(b - a), size_of(c - a));
  return sweep;
}

RoundSweep RoundSweep::to_box(Vec3d half_axis, double radius, Vec3d center, Vec3d half, Vec3d velocity) {
  RoundSweep sweep(Primitive::kBox, half_axis, radius, velocity);
  sweep.a_ = center;
  sweep.b_ = half;
  sweep.size_ = size_of(half_axis) + size_of(half);
  return sweep;
}

NearestPair RoundSweep::pair_at(double t) const {
  const Vec3d moved = velocity_ * t;
  switch (primitive_) {
    case Primitive::kSegment:
      return nearest_to_segment(half_axis_, a_ + moved, b_);
    case Primitive::kTriangle:
      return nearest_to_triangle(half_axis_, a_ + moved, b_ + moved, c_ + moved);
    case Primitive::kBox:
      return nearest_to_box(half_axis_, a_ + moved, b_);
  }
  return {};
}

bool RoundSweep::touches(const NearestPair& pair, double t) const {
  const double epsilon =
      kPlaceEpsilon * (size_of(pair.on_primitive) + size_ + radius_) + kWayEpsilon * t * size_of(velocity_);
  const double reach = radius_ + epsilon;
  return pair.squared_distance <= reach * reach;
}

std::optional<double> RoundSweep::first_contact(double limit, double from) const {
  LOCUS_DCHECK_GE(radius_, 0.0);
  double t = from;
  for (int step = 0; step < kMaxSteps; ++step) {
    const NearestPair pair = pair_at(t);
    const bool is_contact = touches(pair, t);
    if (is_contact && t == 0) return planted(PlantedBug::kSweepStart) ? std::nullopt : std::optional<double>(t);
    const double distance = std::sqrt(pair.squared_distance);
    // Speed at which the distance decreases: the component of the velocity along the offset from primitive to segment.
    const double approach = dot(pair.offset(), velocity_) / distance;
    if (is_contact && !(approach > 0 && distance > radius_)) return t;
    if (!(approach > 0)) return std::nullopt;
    // If only the epsilon makes this a contact, one last step advances to the moment at which the distance is the
    // radius.
    t += (distance - radius_) / approach;
    if (is_contact) return std::min(t, 1.0) <= limit ? std::optional<double>(std::min(t, 1.0)) : std::nullopt;
    if (!(t <= limit)) return std::nullopt;
  }
  return t;  // contact not decidable within the precision of t: report it, so that no contact is missed
}

RoundSweep::Separation RoundSweep::separation_at(double t) const {
  const NearestPair pair = pair_at(t);
  const double distance = std::sqrt(pair.squared_distance);
  // If the distance consists only of rounding errors, its direction has no meaning.
  if (distance > kPlaceEpsilon * (size_of(pair.on_primitive) + size_))
    return {distance, pair.offset() * (1 / distance), pair};
  return way_out_at(t, pair);
}

RoundSweep::Separation RoundSweep::way_out_at(double t, const NearestPair& pair) const {
  const Vec3d motion = -velocity_;
  if (primitive_ == Primitive::kSegment) return {0, against(cross(half_axis_, b_), motion), pair};
  if (primitive_ == Primitive::kTriangle) return {0, against(cross(b_ - a_, c_ - a_), motion), pair};
  // The shortest way out of a box is parallel to a face normal of the box swept along the segment. These normals are
  // the axes of the box, and the directions perpendicular to one of these axes and to the segment.
  const Vec3d offset = -(a_ + velocity_ * t);  // from the box's centre to the segment's midpoint
  double depth = std::numeric_limits<double>::infinity();
  Vec3d best;
  for (int i = 0; i < 6; ++i) {
    Vec3d unit;
    unit[i % 3] = 1;
    Vec3d axis = unit;
    if (i >= 3) {
      axis = cross(half_axis_, unit);
      const double length = std::sqrt(squared_length(axis));
      if (length <= kPlaceEpsilon * size_of(half_axis_)) continue;
      axis = axis * (1 / length);
    }
    const double along = dot(axis, offset);
    const double exit = dot(abs(axis), b_) + std::abs(dot(axis, half_axis_)) - std::abs(along);
    if (!(exit < depth)) continue;
    depth = exit;
    best = along == 0 ? against(axis, motion) : along > 0 ? axis : -axis;
  }
  return {-std::max(depth, 0.0), best, pair};
}

}  // namespace locus
