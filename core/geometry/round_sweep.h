// Motion of a convex primitive towards a segment, with a radius around the segment: the relative motion of a mover and
// a primitive, at least one of which is round. Computes the first moment at which the distance between the primitive
// and the segment is at most the radius.
//
// The distance between convex sets in relative translation is a convex function of time, so its tangent at any moment
// is a lower bound. Newton's method from t = 0 therefore approaches the first contact from below and never passes it.
// Source: Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, 1996 (conservative advancement); for pure
// translation the bound is the tangent, and the convergence is quadratic except for a grazing contact.
//
// Immutable; any thread. Products, sums, quotients and square roots in a fixed order.
#ifndef LOCUS_CORE_GEOMETRY_ROUND_SWEEP_H_
#define LOCUS_CORE_GEOMETRY_ROUND_SWEEP_H_

#include <cstdint>
#include <optional>

#include "core/geometry/nearest_pair.h"

namespace locus {

class RoundSweep {
 public:
  // Make the motion of a primitive (a segment, a triangle or a box) relative to the segment from -half_axis to
  // half_axis. `velocity` is the velocity of the primitive relative to the segment. Positions are those at t = 0,
  // relative to the midpoint of this segment; `radius` >= 0. All vectors of to_box() are in the box's own axes.
  static RoundSweep to_segment(Vec3d half_axis, double radius, Vec3d center, Vec3d other_half_axis, Vec3d velocity);
  static RoundSweep to_triangle(Vec3d half_axis, double radius, Vec3d a, Vec3d b, Vec3d c, Vec3d velocity);
  static RoundSweep to_box(Vec3d half_axis, double radius, Vec3d center, Vec3d half, Vec3d velocity);

  // Returns the nearest points at time t.
  NearestPair pair_at(double t) const;
  // Returns whether the distance of `pair`, at time t, is at most the radius plus an epsilon for rounding: 2^-44 of the
  // magnitudes involved.
  bool touches(const NearestPair& pair, double t) const;
  // Returns the first t in 0 .. limit at which the distance is at most the radius, or nullopt. The result may be
  // earlier than the exact moment, by at most the epsilon of touches() divided by the speed of approach. It is later
  // than the exact moment only by rounding errors. The search begins at `from`, which must be a lower bound of the
  // result and >= 0.
  std::optional<double> first_contact(double limit, double from = 0) const;
  // Distance, direction and nearest points of primitive and segment. `distance` is negative if the segment reaches
  // into a box. `direction` is the unit vector from the primitive to the segment. If the segment intersects the
  // primitive, `direction` is the direction of the shortest way out of the primitive; among several shortest ways, one
  // against the segment's motion.
  struct Separation {
    double distance;
    Vec3d direction;
    NearestPair pair;
  };
  // Returns the separation at time t.
  Separation separation_at(double t) const;

 private:
  enum class Primitive : uint8_t { kSegment, kTriangle, kBox };

  RoundSweep(Primitive primitive, Vec3d half_axis, double radius, Vec3d velocity)
      : primitive_(primitive), half_axis_(half_axis), radius_(radius), velocity_(velocity) {}

  Separation way_out_at(double t, const NearestPair& pair) const;

  Primitive primitive_;
  Vec3d half_axis_;
  double radius_;
  Vec3d velocity_;
  Vec3d a_, b_, c_;  // corners of a triangle; for a segment or box, a_: centre, b_: half axis or half extents
  // Largest |component| of half_axis_, plus the largest |component| of b_ (for a triangle: of b_ - a_ and c_ - a_).
  double size_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_ROUND_SWEEP_H_
