#include "core/geometry/ray_ball.h"

#include "core/base/check.h"

namespace locus {

std::optional<Interval<double>> line_in_ball(const Line& line, double squared_radius) {
  const double dd = squared_length(line.direction);
  if (dd == 0) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (squared_length(line.origin) <= squared_radius) return Interval<double>{-kInfinity, kInfinity};
    return std::nullopt;
  }
  const double rest = squared_radius * dd - squared_length(cross(line.origin, line.direction));
  if (!(rest >= 0)) return std::nullopt;
  const double middle = -dot(line.origin, line.direction);
  const double half = std::sqrt(rest);
  return Interval<double>{(middle - half) / dd, (middle + half) / dd};
}

std::optional<Chord> chord_of_ball(const Line& line, double radius) {
  LOCUS_DCHECK_GE(radius, 0.0);
  const std::optional<Interval<double>> t = line_in_ball(line, radius * radius);
  if (!t) return std::nullopt;
  if (radius == 0) return Chord{t->near, t->far, -line.direction, line.direction};
  return Chord{t->near, t->far, line.origin + line.direction * t->near, line.origin + line.direction * t->far};
}

bool ball_contains(double radius, Vec3d point) { return squared_length(point) <= radius * radius; }

}  // namespace locus
