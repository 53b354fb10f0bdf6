#include "core/geometry/segment.h"

#include <array>
#include <limits>

namespace locus {
namespace {

// How far outside the box each coordinate is, with its sign; 0 inside.
Vec3d gap_to_box(Vec3d point, Vec3d half) {
  Vec3d gap;
  for (int axis = 0; axis < 3; ++axis)
    gap[axis] = point[axis] - std::min(std::max(point[axis], -half[axis]), half[axis]);
  return gap;
}

// Places on the segment where a coordinate enters or leaves the box, and the two ends, ascending.
std::array<double, 8> joints_of(Vec3d center, Vec3d half_axis, Vec3d half) {
  std::array<double, 8> joints;
  joints.fill(1);
  joints[0] = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = half_axis[axis];
    if (a == 0) continue;
    joints[2 * axis + 2] = std::min(std::max((half[axis] - center[axis]) / a, -1.0), 1.0);
    joints[2 * axis + 1] = std::min(std::max((-half[axis] - center[axis]) / a, -1.0), 1.0);
  }
  std::sort(joints.begin(), joints.end());
  return joints;
}

// The least value of the parabola that holds between two joints, if it is taken between them, else infinity. It is the
// distance of a line from a corner, edge or face, judged by a cross product and one division, exact where the result is
// a small whole number.
double least_between(double from, double to, Vec3d center, Vec3d half_axis, Vec3d half) {
  const Vec3d gap = gap_to_box(center + half_axis * (0.5 * (from + to)), half);
  Vec3d base, along;  // of the line, in the coordinates that are outside the box
  for (int axis = 0; axis < 3; ++axis) {
    if (gap[axis] == 0) continue;
    base[axis] = center[axis] - std::copysign(half[axis], gap[axis]);
    along[axis] = half_axis[axis];
  }
  const double aa = squared_length(along);
  if (aa == 0) return squared_length(base);
  constexpr double kRounding = 1e-14;  // a minimum just at a joint must not fall between two parabolas
  const double place = -dot(base, along) / aa;
  if (place < from - kRounding || place > to + kRounding) return std::numeric_limits<double>::infinity();
  return squared_length(cross(base, along)) / aa;
}

}  // namespace

Vec3d nearest_on_segment(Vec3d point, Vec3d half_axis) {
  const double aa = squared_length(half_axis);
  const double along = dot(point, half_axis);
  if (along >= aa) return half_axis;
  if (along <= -aa) return -half_axis;
  return half_axis * (along / aa);
}

double squared_distance_to_segment(Vec3d point, Vec3d half_axis) {
  const double aa = squared_length(half_axis);
  const double along = dot(point, half_axis);
  if (along >= aa) return squared_length(point - half_axis);
  if (along <= -aa) return squared_length(point + half_axis);
  return squared_length(cross(point, half_axis)) / aa;
}

bool segment_meets_box(Vec3d center, Vec3d half_axis, Vec3d half) {
  const Vec3d a = abs(half_axis);
  const Vec3d across = abs(cross(center, half_axis));
  for (int x = 0; x < 3; ++x) {
    const int y = (x + 1) % 3, z = (x + 2) % 3;
    if (std::abs(center[x]) > half[x] + a[x]) return false;
    if (across[x] > half[y] * a[z] + half[z] * a[y]) return false;
  }
  return true;
}

double squared_distance_segment_box(Vec3d center, Vec3d half_axis, Vec3d half) {
  if (segment_meets_box(center, half_axis, half)) return 0;
  const std::array<double, 8> joints = joints_of(center, half_axis, half);
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < joints.size(); ++i) {
    least = std::min(least, squared_length(gap_to_box(center + half_axis * joints[i], half)));
    if (i + 1 == joints.size()) break;
    least = std::min(least, least_between(joints[i], joints[i + 1], center, half_axis, half));
  }
  return least;
}

}  // namespace locus
