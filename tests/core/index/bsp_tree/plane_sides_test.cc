#include "core/index/bsp_tree/plane_sides.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace locus::test {
namespace {

constexpr Plane kHorizontal = {{0, 0, 1}, -2};  // z = 2, front above
constexpr double kUnbounded = std::numeric_limits<double>::infinity();

TEST(PlaneSidesTest, ABoxThatTouchesThePlaneLiesOnBothSides) {
  for (const Aabbd& box : {Aabbd{{0, 0, 1}, {1, 1, 2}}, Aabbd{{0, 0, 2}, {1, 1, 3}}, Aabbd{{0, 0, 2}, {1, 1, 2}}})
    EXPECT_TRUE(sides_of(kHorizontal, box).both());
}

TEST(PlaneSidesTest, ABoxBeyondThePlaneLiesOnOneSide) {
  const Sides above = sides_of(kHorizontal, {{0, 0, 2.001}, {1, 1, 3}});
  EXPECT_TRUE(above.front);
  EXPECT_FALSE(above.back);
  const Sides below = sides_of(kHorizontal, {{0, 0, 0}, {1, 1, 1.999}});
  EXPECT_FALSE(below.front);
  EXPECT_TRUE(below.back);
}

TEST(PlaneSidesTest, ARegionWithoutEndLiesOnBothSides) {
  EXPECT_TRUE(
      sides_of(kHorizontal, {{-kUnbounded, -kUnbounded, -kUnbounded}, {kUnbounded, kUnbounded, kUnbounded}}).both());
}

// A point of a box is computed with other roundings than the corners of the box, and still lies on a side of the box.
TEST(PlaneSidesTest, BoxesThatShareAPointShareASideOfEveryPlaneThroughIt) {
  Random random(5);
  for (int i = 0; i < 100'000; ++i) {
    const double size = random.magnitude(-30, 30);
    const Vec3d point = random.vector(size);
    const Vec3d normal = random.unit_vector();
    const Plane plane = {normal, -dot(normal, point)};
    const Sides a = sides_of(plane, {point - random.positive_vector(size), point});
    const Sides b = sides_of(plane, {point, point + random.positive_vector(size)});
    ASSERT_TRUE((a.front && b.front) || (a.back && b.back)) << "turn " << i;
  }
}

TEST(PlaneSidesTest, TheDistanceBeyondAPlaneIsNeverAboveThatOfABoxBeyondIt) {
  Random random(6);
  for (int i = 0; i < 100'000; ++i) {
    const Vec3d normal = random.unit_vector();
    const Plane plane = {normal, random.between(-2, 2)};
    const Vec3d point = random.vector(10), corner = random.vector(10);
    const Aabbd box = {corner, corner + random.positive_vector(1)};
    const Sides sides = sides_of(plane, box);
    const bool in_front = signed_distance(plane, point) >= 0;
    if (sides.both() || sides.front == in_front) continue;
    ASSERT_LE(squared_distance_beyond(plane, point), squared_distance(point, box)) << "turn " << i;
  }
}

TEST(PlaneSidesTest, AnExactRayIsBehindUntilItCrossesThePlane) {
  const Rayd up = {{0, 0, 0}, {0, 0, 0.5}};
  const SideSpans spans = exact_spans(kHorizontal, up, {0, 10});
  EXPECT_FALSE(spans.front_first);
  EXPECT_EQ(spans.back.begin, 0);
  EXPECT_EQ(spans.back.end, 4);
  EXPECT_EQ(spans.front.begin, 4);
  EXPECT_EQ(spans.front.end, 10);
}

TEST(PlaneSidesTest, AnExactRayInThePlaneIsInFrontOfIt) {
  const SideSpans spans = exact_spans(kHorizontal, {{0, 0, 2}, {1, 0, 0}}, {0, 10});
  EXPECT_FALSE(spans.front.empty());
  EXPECT_TRUE(spans.back.empty());
}

TEST(PlaneSidesTest, AnExactRayOfLengthZeroHasOneSide) {
  for (const double z : {1.0, 2.0, 3.0}) {
    const SideSpans spans = exact_spans(kHorizontal, {{0, 0, z}, {0, 0, 1}}, {0, 0});
    EXPECT_NE(spans.front.empty(), spans.back.empty()) << z;
  }
}

TEST(PlaneSidesTest, TheSpansOfAPaddedRayOverlapByThePad) {
  const PaddedRay ray(SlabRay<double>({{0, 0, 0}, {0, 0, 4}}, kObjectPad), 8.0);
  ASSERT_GT(ray.pad(), 0);
  const SideSpans spans = padded_spans(kHorizontal, ray, {0, kUnbounded});
  EXPECT_FALSE(spans.front_first);
  EXPECT_DOUBLE_EQ(spans.front.begin, 2 - ray.pad());
  EXPECT_DOUBLE_EQ(spans.back.end, 2 + ray.pad());
}

TEST(PlaneSidesTest, APaddedRayBesideThePlaneIsOnBothSidesWithinThePad) {
  const PaddedRay in(SlabRay<double>({{0, 0, 2}, {1, 0, 0}}, kObjectPad), 8.0);
  const SideSpans near = padded_spans(kHorizontal, in, {0, 1});
  EXPECT_FALSE(near.front.empty());
  EXPECT_FALSE(near.back.empty());
  const PaddedRay above(SlabRay<double>({{0, 0, 2.5}, {1, 0, 0}}, kObjectPad), 8.0);
  EXPECT_TRUE(padded_spans(kHorizontal, above, {0, 1}).back.empty());
}

}  // namespace
}  // namespace locus::test
