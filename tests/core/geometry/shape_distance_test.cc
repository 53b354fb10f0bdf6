// Tests of distances between shapes, compared with alternating projections in long double.
#include "core/geometry/shape_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/geometry/segment.h"
#include "tests/support/random.h"
#include "tests/support/random_shape.h"
#include "tests/support/real.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

// Returns the point of the shape's solid that is nearest to `point`.
Vec3r nearest_of(const Shape& shape, Vec3r point) {
  const Vec3r local = turned_back(shape.rotation, point - to_real(shape.position));
  const Vec3r size = to_real(to_double(shape.size));
  Vec3r core;
  if (shape.kind == ShapeKind::kBox) {
    for (int axis = 0; axis < 3; ++axis) core[axis] = std::clamp(local[axis], -size[axis], size[axis]);
    return to_real(shape.position) + turned(shape.rotation, core);
  }
  const Real squared = dot(size, size);
  if (shape.kind == ShapeKind::kCapsule && squared > 0)
    core = size * std::clamp(dot(local, size) / squared, Real{-1}, Real{1});
  const Real radius = shape.kind == ShapeKind::kPoint ? Real{0} : Real{shape.radius};
  const Vec3r away = local - core;
  const Real far = length(away);
  const Vec3r at = far <= radius ? local : core + away * (radius / far);
  return to_real(shape.position) + turned(shape.rotation, at);
}

Real reference(const Shape& a, const Shape& b) {
  Vec3r on_a = to_real(a.position), on_b;
  Real before = 1e30L;
  for (int round = 0; round < 20'000; ++round) {
    on_b = nearest_of(b, on_a);
    on_a = nearest_of(a, on_b);
    const Real now = length(on_a - on_b);
    if (before - now < 1e-12L && round > 5) break;
    before = now;
  }
  return length(on_a - on_b);
}

Shape shape_near(Random& random, double size) {
  Shape shape = random_shape(random, random.pick(kShapeKinds), size);
  for (int axis = 0; axis < 3; ++axis) shape.size[axis] = random.chance(0.1) ? 0.0f : random.float_between(0, 2);
  shape.radius = random.float_between(0, 1.5f);
  return shape;
}

TEST(ShapeDistanceTest, RandomShapesAreAsFarApartAsTheirNearestPoints) {
  size_t apart = 0;
  for (uint64_t seed = 0; seed < scaled_count(4'000); ++seed) {
    Random random(seed);
    const Shape a = shape_near(random, 3), b = shape_near(random, 3);
    const double found = distance_between(a, b);
    const Real expected = reference(a, b);
    apart += expected > 0.01L ? 1 : 0;
    // Alternating projections approach the distance from above, and converge slowly if the solids barely touch.
    ASSERT_LE(found, double(expected) + 1e-6) << "seed " << seed;
    ASSERT_GE(found, double(expected) - 2e-3 - 1e-3 * double(expected)) << "seed " << seed;
    ASSERT_NEAR(distance_between(b, a), found, 1e-9) << "seed " << seed;
    ASSERT_GE(found, distance_between(bounds_of(a), bounds_of(b))) << "seed " << seed;
  }
  EXPECT_GT(apart, scaled_count(1'000));
}

Shape shape(ShapeKind kind, Vec3d position, Vec3f size, float radius = 0) {
  Shape result;
  result.kind = kind;
  result.position = position;
  result.size = size;
  result.radius = radius;
  return result;
}

TEST(ShapeDistanceTest, WholeNumbersAreExact) {
  const Shape box = shape(ShapeKind::kBox, {0, 0, 0}, {1, 1, 1}), ball = shape(ShapeKind::kBall, {4, 5, 1}, {}, 2);
  EXPECT_EQ(distance_between(box, ball), 3);
  EXPECT_EQ(distance_between(box, shape(ShapeKind::kBox, {4, 5, 0}, {0, 0, 5})), 5);
  EXPECT_EQ(distance_between(box, shape(ShapeKind::kBox, {2, 0, 0}, {1, 1, 1})), 0);
  EXPECT_EQ(
      distance_between(shape(ShapeKind::kCapsule, {0, 0, 0}, {5, 0, 0}, 1), shape(ShapeKind::kPoint, {2, 4, 0}, {})),
      3);
  EXPECT_EQ(distance_between(shape(ShapeKind::kCapsule, {0, 0, 0}, {5, 0, 0}, 1),
                             shape(ShapeKind::kCapsule, {0, 0, 7}, {0, 5, 0}, 2)),
            4);
}

TEST(ShapeDistanceTest, TheLeastExtentIsThatOfTheFarthestPoint) {
  EXPECT_EQ(least_along({1, 0, 0}, shape(ShapeKind::kBall, {5, 0, 0}, {}, 2)), 3);
  EXPECT_EQ(least_along({0, 1, 0}, shape(ShapeKind::kBox, {0, 5, 0}, {1, 2, 3})), 3);
  EXPECT_EQ(least_along({0, 0, 1}, shape(ShapeKind::kCapsule, {0, 0, 9}, {0, 0, -4}, 1)), 4);
  EXPECT_EQ(least_along({0, 0, -1}, Aabbd{{-1, -1, -1}, {1, 1, 4}}), -4);
  EXPECT_EQ(least_along({1, 0, 0}, Corners{Vec3d{3, 0, 0}, Vec3d{-2, 1, 1}, Vec3d{5, 5, 5}}), -2);
}

TEST(ShapeDistanceTest, BallsAndPointsAreMeasuredLikeSegmentsOfLengthZero) {
  Random random(12);
  for (int trial = 0; trial < 100'000; ++trial) {
    const double size = random.pick(std::vector<double>{1e-3, 1, 1e6});
    Shape shapes[2];
    for (Shape& shape : shapes) {
      shape.kind = random.between(0, 1) < 0.5 ? ShapeKind::kPoint : ShapeKind::kBall;
      shape.position = random.vector(size);
      shape.radius = static_cast<float>(random.between(0, 1));
    }
    if (trial % 3 == 0) shapes[1].position.x = shapes[0].position.x;
    if (trial % 6 == 0) shapes[1].position.y = shapes[0].position.y;
    // Nearly along an axis, the distance of the bounds is nearly that of the balls.
    if (trial % 5 == 0)
      shapes[1].position = shapes[0].position + Vec3d{random.between(0, 4), std::exp2(-random.between(0, 60)), 0};
    double apart = std::sqrt(squared_distance_segments(shapes[1].position - shapes[0].position, {}, {}));
    for (const Shape& shape : shapes) apart -= shape.kind == ShapeKind::kBall ? double{shape.radius} : 0;
    const double expected = std::max(apart, distance_between(bounds_of(shapes[0]), bounds_of(shapes[1])));
    EXPECT_EQ(distance_between(shapes[0], shapes[1]), expected);
  }
}

}  // namespace
}  // namespace locus::test
