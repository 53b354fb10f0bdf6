#include "core/geometry/obb_obb.h"

#include "gtest/gtest.h"
#include "tests/support/box_clip.h"
#include "tests/support/random.h"

namespace locus {
namespace {

using test::Random;
using test::Real;
using test::to_real;

Obbd axis_aligned(Vec3d center, Vec3d half) { return {center, half, {}}; }

TEST(ObbObbTest, TouchingFacesEdgesAndCornersOverlapAndGapsDoNot) {
  const Obbd a = axis_aligned({0, 0, 0}, {1, 2, 3});
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        const Vec3d touching = {2.0 * x, 3.0 * y, 4.0 * z};
        EXPECT_TRUE(boxes_overlap(a, axis_aligned(touching, {1, 1, 1})));
        EXPECT_FALSE(boxes_overlap(a, axis_aligned(touching * (1 + 0x1p-50), {1, 1, 1})));
      }
}

TEST(ObbObbTest, CrossedNeedlesAreSeparatedByACrossProductAxis) {
  // Two needles, one above the other, the second rotated around z by a small angle. Each is also rolled around itself,
  // so that no face axis separates them.
  constexpr uint64_t kSeed = 111;
  Random random(kSeed);
  for (int i = 0; i < 2000; ++i) {
    const double angle = random.magnitude(-24, 0);
    const auto roll = [&](double about_z) {  // about z, after a roll of 45 degrees about the needle
      const double r = 0.39269908169872414, h = about_z / 2;
      return Quaternion{static_cast<float>(std::cos(h) * std::sin(r)), static_cast<float>(std::sin(h) * std::sin(r)),
                        static_cast<float>(std::sin(h) * std::cos(r)), static_cast<float>(std::cos(h) * std::cos(r))};
    };
    const Quaternion qa = roll(0), qb = roll(angle);
    const Vec3d half = {1, 1e-9, 1e-9};
    const Obbd a{{0, 0, 0}, half, rotation_of(qa)}, b{{0, 0, random.between(-1e-7, 1e-7)}, half, rotation_of(qb)};
    const test::RealBox ra = test::real_box({}, qa, to_real(half));
    const test::RealBox rb = test::real_box(to_real(b.center), qb, to_real(half));
    if (!test::boxes_share_a_point(ra, rb, 2e-9L)) {
      ASSERT_FALSE(boxes_overlap(a, b)) << "seed " << kSeed << " case " << i;
    } else if (test::boxes_share_a_point(ra, rb, -2e-10L)) {
      ASSERT_TRUE(boxes_overlap(a, b)) << "seed " << kSeed << " case " << i;
    }
  }
}

TEST(ObbObbTest, NearlyParallelEdgesNeverSeparateWhatOverlaps) {
  constexpr uint64_t kSeed = 112;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Quaternion q = random.rotation();
    Quaternion p = q;
    const double noise = random.magnitude(-40, -10);
    p.x += static_cast<float>(random.between(-noise, noise));
    p.w += static_cast<float>(random.between(-noise, noise));
    const Vec3d half = random.positive_vector(1);
    const Obbd a{random.vector(1e3), half, rotation_of(q)};
    Vec3d inside = random.vector(1);
    for (int axis = 0; axis < 3; ++axis) inside[axis] *= 1.9 * half[axis];
    const Obbd b{a.center + a.rotation.to_world(inside), half, rotation_of(p)};
    const test::RealBox ra = test::real_box(to_real(a.center), q, to_real(half));
    const test::RealBox rb = test::real_box(to_real(b.center), p, to_real(half));
    if (!test::boxes_share_a_point(ra, rb, -1e-11L)) continue;
    ASSERT_TRUE(boxes_overlap(a, b)) << "seed " << kSeed << " case " << i;
    ASSERT_TRUE(boxes_overlap(b, a)) << "seed " << kSeed << " case " << i;
  }
}

TEST(ObbObbTest, RotatedBoxesThatTouchOverlap) {
  const float s = std::sqrt(0.5f);
  const Rotation quarter = rotation_of({0, 0, s, s});
  EXPECT_TRUE(boxes_overlap({{0, 0, 0}, {1, 2, 3}, quarter}, axis_aligned({3, 0, 0}, {1, 1, 1})));
  EXPECT_FALSE(boxes_overlap({{0, 0, 0}, {1, 2, 3}, quarter}, axis_aligned({3.000001, 0, 0}, {1, 1, 1})));
}

TEST(ObbObbTest, BoxesWithZeroExtentsArePointsSegmentsAndPlates) {
  EXPECT_TRUE(boxes_overlap(axis_aligned({1, 1, 1}, {0, 0, 0}), axis_aligned({0, 0, 0}, {1, 1, 1})));
  EXPECT_FALSE(boxes_overlap(axis_aligned({1, 1, 1.0000001}, {0, 0, 0}), axis_aligned({0, 0, 0}, {1, 1, 1})));
  const Rotation turned = rotation_of(normalized(Quaternion{0.1f, 0.2f, 0.3f, 0.9f}));
  EXPECT_TRUE(boxes_overlap({{0, 0, 0}, {5, 0, 0}, turned}, {{0, 0, 0}, {0, 5, 5}, turned}));
  EXPECT_TRUE(boxes_overlap({{0, 0, 0}, {0, 0, 0}, turned}, {{0, 0, 0}, {0, 0, 0}, {}}));
}

}  // namespace
}  // namespace locus
