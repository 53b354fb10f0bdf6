// Bounds and overlaps of shapes, compared with references by numerical search and by polygon clipping.
#include "core/geometry/shape.h"

#include "gtest/gtest.h"
#include "tests/support/box_clip.h"
#include "tests/support/convex_reference.h"
#include "tests/support/random_shape.h"

namespace locus {
namespace {

using test::Random;
using test::Real;
using test::SolidReference;
using test::to_real;
using test::Vec3r;

struct QueryBox {
  Obbd box;
  Quaternion rotation;
};

QueryBox query_box(Vec3d center, Vec3d half, const Quaternion& rotation) {
  return {{center, half, rotation_of(rotation)}, rotation};
}

// Returns the rounding tolerance of an overlap test of two solids of `size`: one at `position`, the other at `position`
// + `offset`.
Real allowance(Vec3d position, Vec3r offset, double size) {
  return 1e-12L * (test::length(offset) + size) + 1e-15L * test::length(to_real(position));
}

// Returns whether the solid of `shape` and the query's box share a point after one of them is grown by `grown`.
bool reference_overlap(const QueryBox& query, const Shape& shape, Real grown) {
  const Vec3r offset = to_real(shape.position) - to_real(query.box.center);
  const test::RealBox box = test::real_box({}, query.rotation, to_real(query.box.half));
  if (shape.kind == ShapeKind::kBox)
    return test::boxes_share_a_point(box, test::real_box(offset, shape.rotation, to_real(shape.size)), grown);
  const Vec3r half_axis =
      shape.kind == ShapeKind::kCapsule ? test::turned(shape.rotation, to_real(shape.size)) : Vec3r{};
  const auto distance = [&](Real s) {
    const Vec3r outside = abs(box.local(offset + half_axis * s)) - box.half;
    return test::length(max(outside, Vec3r{}));
  };
  const Real nearest = std::min(distance(test::argmin(distance, -1, 1)), std::min(distance(-1), distance(1)));
  const SolidReference solid(shape);
  return nearest <= solid.core_radius() + grown;
}

class ShapeOverlapTest : public testing::TestWithParam<ShapeKind> {};

TEST_P(ShapeOverlapTest, RandomBallsAgreeWithTheReference) {
  constexpr uint64_t kSeed = 31;
  Random random(kSeed + static_cast<uint64_t>(GetParam()));
  int found = 0;
  for (int i = 0; i < 50000; ++i) {
    const Shape shape = test::random_shape(random, GetParam(), i % 4 == 0 ? 1e6 : 10);
    const double size = test::largest_size(shape);
    Balld ball{shape.position + random.vector(1) * (2 * size), size * random.magnitude(-3, 1)};
    if (random.chance(0.1)) ball.radius = 0;
    const Vec3r offset = to_real(ball.center) - to_real(shape.position);
    const SolidReference solid(shape);
    const Real gap = solid.distance_to_core(offset) - solid.core_radius() - ball.radius;
    const Real tolerance = allowance(shape.position, offset, size + ball.radius);
    const bool verdict = ball_overlaps(ball, shape);
    found += verdict;
    if (gap > tolerance) {
      ASSERT_FALSE(verdict) << "seed " << kSeed << " case " << i;
    } else if (gap < -tolerance) {
      ASSERT_TRUE(verdict) << "seed " << kSeed << " case " << i;
    }
  }
  EXPECT_GT(found, 2000);
}

TEST_P(ShapeOverlapTest, VerdictsOnLatticeBallsAreExact) {
  constexpr uint64_t kSeed = 32;
  constexpr Real kTouching = 1e-9L;
  Random random(kSeed + static_cast<uint64_t>(GetParam()));
  int touching = 0;
  for (int i = 0; i < 100000; ++i) {
    const Shape shape = test::lattice_shape(random, GetParam(), 2);
    const Balld ball{random.whole_vector(8), double(random.whole(0, 5))};
    const SolidReference solid(shape);
    const Real gap = solid.distance_to_core(to_real(ball.center - shape.position)) - solid.core_radius() - ball.radius;
    touching += std::abs(gap) < kTouching;
    ASSERT_EQ(ball_overlaps(ball, shape), gap < kTouching) << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(touching, 100);
}

TEST_P(ShapeOverlapTest, RandomBoxesAgreeWithTheReference) {
  constexpr uint64_t kSeed = 33;
  Random random(kSeed + static_cast<uint64_t>(GetParam()));
  int found = 0;
  for (int i = 0; i < 20000; ++i) {
    const Shape shape = test::random_shape(random, GetParam(), i % 4 == 0 ? 1e6 : 10);
    const double size = test::largest_size(shape);
    Vec3d half = random.positive_vector(size * random.magnitude(-3, 1));
    if (random.chance(0.1)) half[static_cast<int>(random.below(3))] = 0;
    const Vec3d center = shape.position + random.vector(1) * (1.5 * size);
    const QueryBox query = query_box(center, half, random.chance(0.7) ? random.rotation() : shape.rotation);
    const Real tolerance = 1000 * allowance(center, to_real(shape.position) - to_real(center), 3 * size);
    const bool verdict = box_overlaps(query.box, shape);
    found += verdict;
    if (!reference_overlap(query, shape, tolerance)) {
      ASSERT_FALSE(verdict) << "seed " << kSeed << " case " << i;
    } else if (reference_overlap(query, shape, -tolerance)) {
      ASSERT_TRUE(verdict) << "seed " << kSeed << " case " << i;
    }
  }
  EXPECT_GT(found, 500);
}

TEST_P(ShapeOverlapTest, VerdictsOnLatticeBoxesAreExact) {
  constexpr uint64_t kSeed = 34;
  Random random(kSeed + static_cast<uint64_t>(GetParam()));
  int touching = 0;
  for (int i = 0; i < 50000; ++i) {
    const Shape shape = test::lattice_shape(random, GetParam(), 2);
    const QueryBox query = query_box(random.whole_vector(7), abs(random.whole_vector(3)), {});
    const bool expected = reference_overlap(query, shape, 1e-9L);
    touching += expected && !reference_overlap(query, shape, -1e-9L);
    ASSERT_EQ(box_overlaps(query.box, shape), expected) << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(touching, 100);
}

// Bounds are used for culling and must never exclude a shape that the predicates accept.
TEST_P(ShapeOverlapTest, BoundsContainTheSolid) {
  constexpr uint64_t kSeed = 35;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Shape shape = test::random_shape(random, GetParam(), random.magnitude(0, 30));
    const Aabbd bounds = bounds_of(shape);
    const SolidReference solid(shape);
    // Computes the farthest point of the solid in a random direction or along an axis.
    Vec3r unit = to_real(random.unit_vector());
    if (random.chance(0.5)) {
      unit = {};
      unit[static_cast<int>(random.below(3))] = random.chance(0.5) ? 1 : -1;
    }
    const Vec3r local = test::turned_back(shape.rotation, unit);
    Vec3r far;
    if (shape.kind == ShapeKind::kBox)
      for (int axis = 0; axis < 3; ++axis) far[axis] = std::copysign(Real{shape.size[axis]}, local[axis]);
    if (shape.kind == ShapeKind::kCapsule)
      far = to_real(shape.size) * std::copysign(1.0L, dot(local, to_real(shape.size)));
    const Vec3r point = to_real(shape.position) + test::turned(shape.rotation, far) + unit * solid.core_radius();
    // Each bound of a ball or box without rotation is a sum that is rounded once. The comparison must tolerate this
    // rounding.
    const Real magnitude = test::length(to_real(shape.position)) + test::largest_size(shape);
    const Real epsilon = shape.rotation.is_identity() ? 0x1p-52L * magnitude : 0;
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_LE(bounds.min[axis] - epsilon, point[axis]) << "seed " << kSeed << " case " << i;
      ASSERT_GE(bounds.max[axis] + epsilon, point[axis]) << "seed " << kSeed << " case " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EveryKind, ShapeOverlapTest, testing::ValuesIn(test::kShapeKinds));

// The full test requires that the ball reaches the shape's bounds and that the distance is small enough; the fast path
// tests most balls by the distance alone. The cases are so close to touching that the two conditions could differ.
TEST(ShapeTest, TheFastPathOfBallsAndPointsEqualsTheFullTest) {
  Random random(11);
  int met = 0;
  for (int i = 0; i < 200'000; ++i) {
    Shape shape;
    shape.kind = random.chance(0.8) ? ShapeKind::kBall : ShapeKind::kPoint;
    shape.position = random.vector(random.magnitude(-20, 30));
    shape.radius = static_cast<float>(random.magnitude(-40, 20));
    const double radius = random.magnitude(-40, 20);
    const double radius_sum = radius + (shape.kind == ShapeKind::kBall ? double{shape.radius} : 0);
    const double near = 1 + random.between(-1, 1) * random.magnitude(-54, -30);
    const Vec3d toward = random.chance(0.5) ? random.unit_vector() : Vec3d{random.chance(0.5) ? 1.0 : -1.0, 0, 0};
    const Balld ball = {shape.position + toward * (radius_sum * near), radius};
    const bool full_test =
        reaches(ball, bounds_of(shape)) && squared_length(ball.center - shape.position) <= radius_sum * radius_sum;
    ASSERT_EQ(ball_overlaps(ball, shape), full_test) << "case " << i;
    met += full_test ? 1 : 0;
  }
  EXPECT_GT(met, 50'000);
  EXPECT_LT(met, 150'000);
}

TEST(ShapeTest, A345TriangleTouchesAndTheNextSmallerRadiusDoesNot) {
  const Shape box{ShapeKind::kBox, {0, 0, 0}, {}, {1, 1, 1}, 0};
  const Vec3d beside_edge = {4, 5, 0};  // the box's edge at x = 1, y = 1 is 3 away along x and 4 along y
  EXPECT_TRUE(ball_overlaps({beside_edge, 5}, box));
  EXPECT_FALSE(ball_overlaps({beside_edge, std::nextafter(5.0, 0.0)}, box));
  const Shape ball{ShapeKind::kBall, {4, 5, 1}, {}, {}, 5};
  EXPECT_TRUE(box_overlaps({{0, 0, 0}, {1, 1, 1}, {}}, ball));
  EXPECT_FALSE(box_overlaps({{0, 0, 0}, {1, 0.999999999999, 1}, {}}, ball));
}

TEST(ShapeTest, TouchingIsExactFarFromTheOrigin) {
  const Shape box{ShapeKind::kBox, {1e9, -1e9, 5e8}, {}, {1, 1, 1}, 0};
  EXPECT_TRUE(ball_overlaps({{1e9 + 4, -1e9 + 5, 5e8}, 5}, box));
  EXPECT_FALSE(ball_overlaps({{1e9 + 4, -1e9 + 5, 5e8}, 4.9999999}, box));
  EXPECT_TRUE(box_overlaps({{1e9 + 3, -1e9, 5e8}, {2, 1, 1}, {}}, box));
  EXPECT_FALSE(box_overlaps({{1e9 + 3, -1e9, 5e8}, {1.9999998, 1, 1}, {}}, box));
}

TEST(ShapeTest, PointsIgnoreTheirSizeAndRadius) {
  const Shape point{ShapeKind::kPoint, {1, 0, 0}, {}, {9, 9, 9}, 9};
  EXPECT_EQ(bounds_of(point), (Aabbd{{1, 0, 0}, {1, 0, 0}}));
  EXPECT_TRUE(ball_overlaps({{0, 0, 0}, 1}, point));
  EXPECT_FALSE(ball_overlaps({{0, 0, 0}, 0.999}, point));
  EXPECT_TRUE(box_overlaps({{0, 0, 0}, {1, 0, 0}, {}}, point));
  EXPECT_FALSE(box_overlaps({{0, 0, 0}, {0.999, 1, 1}, {}}, point));
}

TEST(ShapeTest, BoundsOfAxisAlignedBoxesAndPointsAreExact) {
  const Shape box{ShapeKind::kBox, {10, 20, 30}, {}, {1, 2, 3}, 0};
  EXPECT_EQ(bounds_of(box), (Aabbd{{9, 18, 27}, {11, 22, 33}}));
}

}  // namespace
}  // namespace locus
