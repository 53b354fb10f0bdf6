#include "core/geometry/capsule.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/geometry/segment.h"
#include "core/geometry/segment_triangle.h"
#include "tests/support/convex_reference.h"
#include "tests/support/random.h"
#include "tests/support/random_shape.h"
#include "tests/support/triangle_reference.h"

namespace locus {
namespace {

using test::Random;
using test::Real;
using test::to_real;

// Returns the least value of `distance_at` over the points of a segment. The search requires distance_at() to be convex
// along the segment; the distance to a convex set is convex.
template <class Distance>
Real least_along(Vec3d half_axis, const Distance& distance_at) {
  const auto at = [&](Real s) { return distance_at(to_real(half_axis) * s); };
  return std::min(at(test::argmin(at, -1, 1)), std::min(at(-1), at(1)));
}

Vec3d random_half_axis(Random& random) {
  Vec3d axis = random.vector(random.magnitude(-5, 5));
  if (random.chance(0.3)) axis[static_cast<int>(random.below(3))] = 0;
  return random.chance(0.1) ? Vec3d{} : axis;
}

TEST(SegmentsTest, DistanceAgreesWithASearch) {
  constexpr uint64_t kSeed = 141;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Vec3d offset = random.vector(random.magnitude(-5, 5));
    const Vec3d first = random_half_axis(random);
    Vec3d second = random_half_axis(random);
    if (random.chance(0.2)) second = first * random.between(-2, 2);
    const auto to_second = [&](test::Vec3r p) {
      return least_along(second, [&](test::Vec3r q) { return test::length(to_real(offset) + q - p); });
    };
    const Real expected = least_along(first, to_second);
    const double size = max_component(abs(offset)) + max_component(abs(first)) + max_component(abs(second));
    const double actual = std::sqrt(squared_distance_segments(offset, first, second));
    ASSERT_NEAR(actual, static_cast<double>(expected), 1e-9 * size) << "seed " << kSeed << " case " << i;
    ASSERT_GE(actual, static_cast<double>(expected) - 1e-12 * size) << "seed " << kSeed << " case " << i;
    ASSERT_NEAR(actual, std::sqrt(squared_distance_segments(-offset, second, first)), 1e-9 * size);
  }
}

TEST(SegmentTriangleTest, DistanceAgreesWithASearch) {
  constexpr uint64_t kSeed = 142;
  Random random(kSeed);
  int crossing = 0;
  for (int i = 0; i < 300; ++i) {
    const Triangle t = test::random_triangle(random);
    const double size = test::size_of(t) + max_component(abs(to_double(t.a)));
    const Vec3d half_axis = random.vector(size * random.magnitude(-3, 1));
    Vec3d center = to_double(t.a) + random.vector(size);
    if (random.chance(0.5)) {  // the segment passes through or near a point of the triangle
      const double u = random.between(0, 1), v = random.between(0, 1 - u);
      center =
          to_double(t.a) + to_double(t.b - t.a) * u + to_double(t.c - t.a) * v + half_axis * random.between(-1.1, 1.1);
    }
    const Real expected =
        least_along(half_axis, [&](test::Vec3r p) { return test::reference_distance(to_real(center) + p, t); });
    const double actual =
        std::sqrt(squared_distance_segment_triangle(center, half_axis, to_double(t.a), to_double(t.b), to_double(t.c)));
    crossing += actual == 0;
    const double scale = size + max_component(abs(half_axis)) + max_component(abs(center));
    ASSERT_NEAR(actual, static_cast<double>(expected), 2e-6 * scale) << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(crossing, 30);
}

// Returns the distance from a point to a shape's solid; `offset` is relative to the shape's position.
Real distance_to(const Shape& shape, test::Vec3r offset) {
  if (shape.kind != ShapeKind::kBox) return std::max(Real{0}, test::SolidReference(shape).gauge(offset));
  const test::Vec3r outside = abs(test::turned_back(shape.rotation, offset)) - to_real(shape.size);
  return test::length(max(outside, test::Vec3r{}));
}

TEST(CapsuleTest, OverlapWithShapesAgreesWithASearch) {
  constexpr uint64_t kSeed = 144;
  Random random(kSeed);
  int overlaps = 0, misses = 0;
  for (int i = 0; i < 20000; ++i) {
    const Shape shape = test::random_shape(random, static_cast<ShapeKind>(i % 4), 100);
    const double size = max_component(abs(to_double(shape.size))) + shape.radius;
    Capsule capsule{shape.position + random.vector(3 * size + 0.1), random.vector(size * random.magnitude(-3, 3)), 0};
    const Real expected = least_along(capsule.half_axis, [&](test::Vec3r p) {
      return distance_to(shape, to_real(capsule.center) - to_real(shape.position) + p);
    });
    const double around = max_component(abs(capsule.center)) + max_component(abs(capsule.half_axis)) + size + 1;
    const double gap = 1e-9 * around;
    capsule.radius = static_cast<double>(expected) + gap;
    EXPECT_TRUE(capsule_overlaps(capsule, shape)) << "seed " << kSeed << " case " << i;
    ++overlaps;
    if (expected <= 2 * gap) continue;
    capsule.radius = static_cast<double>(expected) - gap;
    EXPECT_FALSE(capsule_overlaps(capsule, shape)) << "seed " << kSeed << " case " << i;
    ++misses;
  }
  EXPECT_GT(overlaps, 10000);
  EXPECT_GT(misses, 5000);
}

TEST(CapsuleTest, TouchingCounts) {
  const Capsule capsule{{0, 0, 0}, {0, 0, 5}, 2};
  EXPECT_TRUE(capsule_overlaps(capsule, Shape{ShapeKind::kPoint, {2, 0, 5}, {}, {}, 0}));
  EXPECT_TRUE(capsule_overlaps(capsule, Shape{ShapeKind::kPoint, {0, 0, 7}, {}, {}, 0}));
  EXPECT_FALSE(capsule_overlaps(capsule, Shape{ShapeKind::kPoint, {0, 0, 7.0001}, {}, {}, 0}));
  EXPECT_TRUE(capsule_overlaps(capsule, Shape{ShapeKind::kBall, {6, 0, 1}, {}, {}, 4}));
  EXPECT_TRUE(capsule_overlaps(capsule, Shape{ShapeKind::kBox, {3, 0, 0}, {}, {1, 1, 1}, 0}));
  EXPECT_FALSE(capsule_overlaps(capsule, Shape{ShapeKind::kBox, {3.0001, 0, 0}, {}, {1, 1, 1}, 0}));
  EXPECT_TRUE(capsule_overlaps(capsule, Shape{ShapeKind::kCapsule, {5, 0, 0}, {}, {0, 9, 0}, 3}));
  EXPECT_TRUE(capsule_overlaps(capsule, Triangle{{2, -1, 0}, {2, 1, 0}, {4, 0, 0}, 0}));
  EXPECT_FALSE(capsule_overlaps(capsule, Triangle{{2.5, -1, 0}, {2.5, 1, 0}, {4, 0, 0}, 0}));
  EXPECT_TRUE(capsule_overlaps(Capsule{{0, 0, 0}, {}, 0}, Triangle{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}, 0}));
}

// may_reach() is used for culling: it never drops a box that reaches() accepts, but it drops many other boxes.
TEST(CapsuleTest, EveryBoxThatIsReachedMayBeReached) {
  constexpr uint64_t kSeed = 145;
  Random random(kSeed);
  int reached = 0, dropped = 0;
  for (int i = 0; i < 100000; ++i) {
    const Capsule capsule{random.vector(10), random_half_axis(random), std::abs(random.between(-1, 5))};
    const Vec3d at = capsule.center + random.vector(8);
    const Aabbd box{at, at + random.positive_vector(random.magnitude(-5, 3))};
    reached += reaches(capsule, box);
    dropped += !may_reach(capsule, box);
    ASSERT_TRUE(may_reach(capsule, box) || !reaches(capsule, box)) << "seed " << kSeed << " case " << i;
    ASSERT_TRUE(overlaps(bounds_of(capsule), box) || !reaches(capsule, box));
  }
  EXPECT_GT(reached, 5000);
  EXPECT_GT(dropped, 5000);
}

}  // namespace
}  // namespace locus
