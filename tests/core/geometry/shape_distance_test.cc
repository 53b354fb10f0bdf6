// Distances of points to shapes, compared with references that find the nearest point by numerical search.
#include "core/geometry/shape.h"
#include "gtest/gtest.h"
#include "tests/support/convex_reference.h"
#include "tests/support/random_shape.h"

namespace locus {
namespace {

using test::Random;
using test::Real;
using test::SolidReference;
using test::to_real;
using test::Vec3r;

class PointShapeTest : public testing::TestWithParam<ShapeKind> {};

Real reference_distance(Vec3d point, const Shape& shape) {
  const SolidReference solid(shape);
  return std::max(solid.distance_to_core(to_real(point) - to_real(shape.position)) - solid.core_radius(), Real{0});
}

TEST_P(PointShapeTest, DistanceAgreesWithTheReference) {
  constexpr uint64_t kSeed = 51;
  Random random(kSeed + static_cast<uint64_t>(GetParam()));
  int inside = 0;
  for (int i = 0; i < 50000; ++i) {
    const Shape shape = test::random_shape(random, GetParam(), i % 4 == 0 ? 1e6 : 10);
    const double size = test::largest_size(shape);
    const Vec3d point = shape.position + random.vector(1) * (size * random.magnitude(-3, 3));
    const double actual = distance(point, shape);
    const Real expected = reference_distance(point, shape);
    const double epsilon = 1e-12 * (static_cast<double>(expected) + size) + 1e-15 * max_component(abs(point));
    ASSERT_NEAR(actual, static_cast<double>(expected), epsilon) << "seed " << kSeed << " case " << i;
    inside += actual == 0;
  }
  EXPECT_EQ(inside > 1000, GetParam() != ShapeKind::kPoint);
}

TEST_P(PointShapeTest, DistancesOnALatticeAreTheNearestFloats) {
  constexpr uint64_t kSeed = 52;
  Random random(kSeed + static_cast<uint64_t>(GetParam()));
  int touching = 0;
  for (int i = 0; i < 100000; ++i) {
    const Shape shape = test::lattice_shape(random, GetParam(), 2);
    const Vec3d point = random.whole_vector(8);
    const Real expected = reference_distance(point, shape);
    ASSERT_EQ(static_cast<float>(distance(point, shape)), static_cast<float>(expected < 1e-9L ? 0 : expected))
        << "seed " << kSeed << " case " << i;
    const SolidReference solid(shape);
    touching += std::abs(solid.gauge(to_real(point - shape.position))) < 1e-9L;
  }
  EXPECT_GT(touching, 10);
}

TEST_P(PointShapeTest, TheNearestPointIsInTheSolidAtTheDistance) {
  constexpr uint64_t kSeed = 53;
  Random random(kSeed + static_cast<uint64_t>(GetParam()));
  for (int i = 0; i < 50000; ++i) {
    const Shape shape = test::random_shape(random, GetParam(), 10);
    const double size = test::largest_size(shape);
    const Vec3d point = shape.position + random.vector(1) * (size * random.magnitude(-3, 3));
    const Vec3d nearest = nearest_on_shape(point, shape);
    const double gap = std::sqrt(squared_length(point - nearest));
    const double epsilon = 1e-12 * (gap + size) + 1e-14;
    ASSERT_NEAR(gap, distance(point, shape), epsilon) << "seed " << kSeed << " case " << i;
    ASSERT_LE(static_cast<double>(reference_distance(nearest, shape)), epsilon) << "seed " << kSeed << " case " << i;
  }
}

TEST_P(PointShapeTest, TheDistanceIsNeverLessThanThatToTheBounds) {
  constexpr uint64_t kSeed = 54;
  Random random(kSeed);
  for (int i = 0; i < 50000; ++i) {
    const Shape shape = test::random_shape(random, GetParam(), random.magnitude(0, 20));
    const Vec3d point = shape.position + random.vector(test::largest_size(shape) * random.magnitude(-3, 30));
    ASSERT_GE(distance(point, shape), std::sqrt(squared_distance(point, bounds_of(shape))))
        << "seed " << kSeed << " case " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(EveryKind, PointShapeTest, testing::ValuesIn(test::kShapeKinds));

TEST(PointShapeValueTest, APointInsideASolidIsItsOwnNearestPoint) {
  const Vec3d point = {0.1, 0.2, 0.3};
  for (const ShapeKind kind : {ShapeKind::kBall, ShapeKind::kBox, ShapeKind::kCapsule}) {
    const Shape shape{kind, {0, 0, 0}, {0, 0, 0.6f, 0.8f}, {1, 1, 1}, 1};
    EXPECT_EQ(distance(point, shape), 0);
    EXPECT_EQ(nearest_on_shape(point, shape), point);
  }
}

TEST(PointShapeValueTest, A345TriangleIsExactFarFromTheOrigin) {
  const Vec3d far = {1e9, -1e9, 5e8};
  const Vec3d point = far + Vec3d{4, 5, 0};
  EXPECT_EQ(distance(point, {ShapeKind::kBox, far, {}, {1, 1, 1}, 0}), 5);
  EXPECT_EQ(nearest_on_shape(point, {ShapeKind::kBox, far, {}, {1, 1, 1}, 0}), (far + Vec3d{1, 1, 0}));
  EXPECT_EQ(distance(far + Vec3d{3, 4, 0}, {ShapeKind::kPoint, far, {}, {9, 9, 9}, 9}), 5);
}

}  // namespace
}  // namespace locus
