#include "core/geometry/transform.h"

#include "gtest/gtest.h"
#include "tests/support/random.h"
#include "tests/support/real.h"

namespace locus {
namespace {

using test::Random;
using test::to_real;

Transform random_transform(Random& random) {
  const Vec3d translation = random.vector(random.magnitude(0, 20));
  const Quaternion rotation = random.chance(0.2) ? Quaternion{} : random.rotation();
  return make_transform(translation, rotation, static_cast<float>(random.magnitude(-10, 10)));
}

TEST(TransformTest, PointToMeshInvertsPointToWorld) {
  constexpr uint64_t kSeed = 101;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Transform transform = random_transform(random);
    const Vec3d mesh = random.vector(random.magnitude(-10, 10));
    const Vec3d back = transform.point_to_mesh(transform.point_to_world(mesh));
    const double tolerance =
        1e-14 * max_component(abs(mesh)) + 4e-16 * max_component(abs(transform.translation)) / double{transform.scale};
    ASSERT_LE(max_component(abs(back - mesh)), tolerance) << "seed " << kSeed << " case " << i;
  }
}

TEST(TransformTest, WorldIsTranslationPlusScaleTimesRotatedMesh) {
  const float s = std::sqrt(0.5f);  // for the quaternion of a rotation by 90 degrees around z
  const Transform transform = make_transform({10, 20, 30}, {0, 0, s, s}, 2);
  EXPECT_LT(max_component(abs(transform.point_to_world({1, 2, 3}) - Vec3d{6, 22, 36})), 1e-14);
  EXPECT_LT(max_component(abs(transform.direction_to_mesh({0, 2, 0}) - Vec3d{1, 0, 0})), 1e-15);
}

TEST(TransformTest, DistanceAlongARayIsTheSameInBothAxes) {
  constexpr uint64_t kSeed = 102;
  Random random(kSeed);
  for (int i = 0; i < 10000; ++i) {
    const Transform transform = random_transform(random);
    const double size = max_component(abs(transform.translation)) + 1;
    const Vec3d origin = random.vector(size), direction = random.vector(1);
    const double t = random.between(0, size);
    const Vec3d through_mesh =
        transform.point_to_world(transform.point_to_mesh(origin) + transform.direction_to_mesh(direction) * t);
    ASSERT_LT(max_component(abs(through_mesh - (origin + direction * t))), 4e-15 * size)
        << "seed " << kSeed << " case " << i;
  }
}

TEST(TransformTest, InstancesWithoutRotationAndScaleAreOnlyTranslated) {
  const Transform transform = make_transform({1, 2, 3}, {}, 1);
  EXPECT_EQ(transform.point_to_mesh({1.5, 2.5, 3.5}), (Vec3d{0.5, 0.5, 0.5}));
  EXPECT_EQ(transform.direction_to_mesh({0.1, 0.2, 0.3}), (Vec3d{0.1, 0.2, 0.3}));
}

TEST(TransformTest, WorldBoundsContainEveryPointOfTheBox) {
  constexpr uint64_t kSeed = 103;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Transform transform = random_transform(random);
    const Vec3f a = random.float_vector(random.magnitude(-10, 10)), b = random.float_vector(random.magnitude(-10, 10));
    const Aabbf box = {min(a, b), max(a, b)};
    const Aabbd world = bounds_to_world(transform, box);
    for (int corner = 0; corner < 8; ++corner) {
      const test::Vec3r mesh = {corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                                corner & 4 ? box.max.z : box.min.z};
      const test::Vec3r place = to_real(transform.translation) +
                                test::turned(transform.quaternion, mesh) * static_cast<test::Real>(transform.scale);
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_LE(world.min[axis], place[axis]) << "seed " << kSeed << " case " << i;
        ASSERT_GE(world.max[axis], place[axis]) << "seed " << kSeed << " case " << i;
      }
    }
  }
}

}  // namespace
}  // namespace locus
