#include "core/geometry/obb.h"

#include "gtest/gtest.h"
#include "tests/support/box_clip.h"
#include "tests/support/random.h"

namespace locus {
namespace {

TEST(ObbTest, BoundsOfAxisAlignedBoxesAreExact) {
  EXPECT_EQ(bounds_of(Obbd{{1, 2, 3}, {4, 5, 6}, {}}), (Aabbd{{-3, -3, -3}, {5, 7, 9}}));
  EXPECT_EQ(bounds_of(Obbf{{1, 2, 3}, {0, 0, 0}, {}}), (Aabbd{{1, 2, 3}, {1, 2, 3}}));
}

TEST(ObbTest, BoundsOfFloatBoxesAreInDouble) {
  const Obbf box{{16777216.0f, 0, 0}, {0.25f, 1, 1}, {}};  // floats have a spacing of 2 there
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

}  // namespace
}  // namespace locus
