#include "core/geometry/obb.h"

#include "gtest/gtest.h"
#include "tests/support/box_clip.h"
#include "tests/support/random.h"

namespace locus {
namespace {

using test::Random;
using test::Real;
using test::to_real;

TEST(ObbTest, BoundsOfAxisAlignedBoxesAreExact) {
  EXPECT_EQ(bounds_of(Obbd{{1, 2, 3}, {4, 5, 6}, {}}), (Aabbd{{-3, -3, -3}, {5, 7, 9}}));
  EXPECT_EQ(bounds_of(Obbf{{1, 2, 3}, {0, 0, 0}, {}}), (Aabbd{{1, 2, 3}, {1, 2, 3}}));
}

TEST(ObbTest, BoundsOfFloatBoxesAreInDouble) {
  const Obbf box{{16777216.0f, 0, 0}, {0.25f, 1, 1}, {}};  // floats above 16777216 have a spacing of 2
  EXPECT_EQ(bounds_of(box).max.x, 16777216.25);
}

TEST(ObbTest, BoundsOfRotatedBoxesContainTheirCornersTightly) {
  constexpr uint64_t kSeed = 121;
  test::Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Quaternion q = random.rotation();
    const Vec3d center = random.vector(random.magnitude(0, 30)),
                half = random.positive_vector(random.magnitude(-10, 10));
    const Aabbd bounds = bounds_of(Obbd{center, half, rotation_of(q)});
    const test::RealBox real = test::real_box(test::to_real(center), q, test::to_real(half));
    test::Vec3r high = test::to_real(center);
    for (int corner = 0; corner < 8; ++corner) {
      const test::Vec3r point = real.corner(corner);
      high = max(high, point);
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_LE(bounds.min[axis], point[axis]) << "seed " << kSeed << " case " << i;
        ASSERT_GE(bounds.max[axis], point[axis]) << "seed " << kSeed << " case " << i;
      }
    }
    const double epsilon = 0x1p-38 * (max_component(abs(center)) + max_component(half));
    for (int axis = 0; axis < 3; ++axis)
      ASSERT_LE(bounds.max[axis] - epsilon, high[axis]) << "seed " << kSeed << " case " << i;
  }
}

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
  // Tests two thin boxes, one above the other along z; the second is rotated around z by an angle that can be tiny.
  // Each box is also rotated by 45 degrees about its own long axis, so that no face axis separates the boxes.
  constexpr uint64_t kSeed = 111;
  Random random(kSeed);
  for (int i = 0; i < 2000; ++i) {
    const double angle = random.magnitude(-24, 0);
    const auto roll = [&](double about_z) {  // rotation about z, after 45 degrees about the box's long axis
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
