#include "core/geometry/segment.h"

#include "gtest/gtest.h"
#include "tests/support/box_clip.h"
#include "tests/support/convex_reference.h"
#include "tests/support/random.h"

namespace locus {
namespace {

using test::Random;
using test::Real;
using test::to_real;

Real gap_at(Vec3d center, Vec3d half_axis, Vec3d half, Real s) {
  const test::Vec3r outside = abs(to_real(center) + to_real(half_axis) * s) - to_real(half);
  return test::length(max(outside, test::Vec3r{}));
}

TEST(SegmentTest, DistanceToABoxAgreesWithASearchAlongTheSegment) {
  constexpr uint64_t kSeed = 131;
  Random random(kSeed);
  for (int i = 0; i < 50000; ++i) {
    const Vec3d half = random.positive_vector(random.magnitude(-5, 5));
    Vec3d half_axis = random.vector(random.magnitude(-5, 5));
    if (random.chance(0.3)) half_axis[static_cast<int>(random.below(3))] = 0;
    if (random.chance(0.1)) half_axis = {};
    const Vec3d center = random.vector(random.magnitude(-5, 6));
    const auto gap = [&](Real s) { return gap_at(center, half_axis, half, s); };
    const Real expected = std::min(gap(test::argmin(gap, -1, 1)), std::min(gap(-1), gap(1)));
    const Real actual = std::sqrt(Real{squared_distance_segment_box(center, half_axis, half)});
    const double size = max_component(abs(center)) + max_component(abs(half_axis));
    ASSERT_NEAR(static_cast<double>(actual), static_cast<double>(expected), 1e-9 * size)
        << "seed " << kSeed << " case " << i;
  }
}

TEST(SegmentTest, VerdictsOnLatticeSegmentsAndBoxesAreExact) {
  constexpr uint64_t kSeed = 132;
  Random random(kSeed);
  int touching = 0;
  for (int i = 0; i < 100000; ++i) {
    const Vec3d center = random.whole_vector(5), half_axis = random.whole_vector(4), half = abs(random.whole_vector(3));
    const test::Vec3r from = to_real(center - half_axis), to = to_real(center + half_axis);
    const bool expected = test::clipped_segment_remains(from, to, to_real(half), 1e-12L);
    touching += expected && !test::clipped_segment_remains(from, to, to_real(half), -1e-12L);
    ASSERT_EQ(segment_meets_box(center, half_axis, half), expected) << "seed " << kSeed << " case " << i;
    ASSERT_EQ(squared_distance_segment_box(center, half_axis, half) == 0, expected)
        << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(touching, 1000);
}

TEST(SegmentTest, DistanceToTheSegmentIsExactForA345Triangle) {
  EXPECT_EQ(squared_distance_to_segment({3, 4, 7}, {0, 0, 9}), 25);
  EXPECT_EQ(squared_distance_to_segment({0, 3, 13}, {0, 0, 9}), 25);
  EXPECT_EQ(squared_distance_to_segment({3, 0, -13}, {0, 0, 9}), 25);
  EXPECT_EQ(squared_distance_to_segment({3, 4, 0}, {}), 25);
  EXPECT_EQ(squared_distance_to_segment({2, 2, 2}, {7, 7, 7}), 0);
}

// The nearest point is at the fraction k / n of the half segment. Most of these fractions are not binary fractions, but
// the distance must be exact nevertheless.
TEST(SegmentTest, DistanceOfAnObliqueSegmentToAnEdgeIsExact) {
  for (int n = 3; n <= 49; n += 2) {
    for (int k = 1 - n; k < n; ++k) {
      const Vec3d half_axis = Vec3d{3, 4, 0} * double(n);
      const Vec3d beside = Vec3d{-4, 3, 1} + Vec3d{3, 4, 0} * double(k);
      EXPECT_EQ(squared_distance_segment_box(beside, half_axis, {0, 0, 5}), 25) << k << " of " << n;
      EXPECT_EQ(squared_distance_segment_box(beside + Vec3d{-2, 2, 0}, half_axis, {2, 2, 5}), 25) << k << " of " << n;
    }
  }
}

TEST(SegmentTest, NearestPointIsOnTheSegment) {
  EXPECT_EQ(nearest_on_segment({5, 1, 2}, {2, 0, 0}), (Vec3d{2, 0, 0}));
  EXPECT_EQ(nearest_on_segment({-5, 1, 2}, {2, 0, 0}), (Vec3d{-2, 0, 0}));
  EXPECT_EQ(nearest_on_segment({1, 7, 7}, {2, 0, 0}), (Vec3d{1, 0, 0}));
  EXPECT_EQ(nearest_on_segment({1, 7, 7}, {}), Vec3d{});
}

}  // namespace
}  // namespace locus
