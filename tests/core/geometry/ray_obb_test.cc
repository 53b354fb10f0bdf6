#include "core/geometry/ray_obb.h"

#include <cstdint>
#include <vector>

#include "core/geometry/shape.h"
#include "gtest/gtest.h"
#include "tests/support/random.h"
#include "tests/support/random_shape.h"

namespace locus {
namespace {

Shape box_of(Vec3d center, Vec3f half, Quaternion rotation = {}) {
  return {ShapeKind::kBox, center, rotation, half, 0};
}

std::vector<Vec3d> signs_of_each_axis() {
  std::vector<Vec3d> signs;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x != 0 || y != 0 || z != 0) signs.push_back({double(x), double(y), double(z)});
  return signs;
}

struct Fraction {  // denominator > 0
  int64_t numerator, denominator;
  friend bool operator<(Fraction a, Fraction b) { return a.numerator * b.denominator < b.numerator * a.denominator; }
};

// Slab test in integer arithmetic, without rounding.
bool exact_hit(const int64_t (&o)[3], const int64_t (&d)[3], const int64_t (&half)[3]) {
  Fraction near{-1000000, 1}, far{1000000, 1};
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0) {
      if (std::abs(o[axis]) > half[axis]) return false;
      continue;
    }
    const int64_t sign = d[axis] < 0 ? -1 : 1;
    const Fraction entry{-half[axis] - sign * o[axis], sign * d[axis]};
    const Fraction exit{half[axis] - sign * o[axis], sign * d[axis]};
    near = std::max(near, entry);
    far = std::min(far, exit);
  }
  return !(far < near) && far.numerator >= 0;
}

TEST(RayObbTest, CornersAndEdgesAreTouchedFromAll26Directions) {
  const Vec3f half = {1, 2, 3};
  const Shape box = box_of({5, -7, 11}, half);
  for (const Vec3d place : signs_of_each_axis()) {  // a corner, edge middle or face middle
    const Vec3d target = box.position + Vec3d{place.x * half.x, place.y * half.y, place.z * half.z};
    for (const Vec3d direction : signs_of_each_axis()) {
      const auto hit = ray_hit(test::ray_from(target - direction * 8.0, direction), box);
      ASSERT_TRUE(hit.has_value());
      EXPECT_GE(hit->t, 0);
      EXPECT_LE(hit->t, 8);
      EXPECT_TRUE(ray_hit(test::ray_from(target, direction), box).has_value());
    }
  }
}

TEST(RayObbTest, VerdictsOnIntegerRaysAreExact) {
  constexpr uint64_t kSeed = 11;
  test::Random random(kSeed);
  int hits = 0;
  for (int i = 0; i < 200000; ++i) {
    int64_t o[3], d[3], half[3];
    for (int axis = 0; axis < 3; ++axis) {
      o[axis] = random.whole(-12, 12);
      d[axis] = random.whole(-7, 7);
      half[axis] = random.whole(0, 4);
    }
    if (d[0] == 0 && d[1] == 0 && d[2] == 0) continue;
    const Vec3d origin = {double(o[0]), double(o[1]), double(o[2])};
    const Vec3d direction = {double(d[0]), double(d[1]), double(d[2])};
    const Shape box = box_of({0, 0, 0}, {float(half[0]), float(half[1]), float(half[2])});
    const bool expected = exact_hit(o, d, half);
    hits += expected;
    ASSERT_EQ(ray_hit(test::ray_from(origin, direction), box).has_value(), expected)
        << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(hits, 5000);
}

TEST(RayObbTest, ARayInAFacePlaneTouchesAndOneBesideItDoesNot) {
  const Shape box = box_of({0, 0, 0}, {1, 1, 1});
  const auto hit = ray_hit(test::ray_from({-4, 1, 0}, {1, 0, 0}), box);
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->t, 3);
  EXPECT_EQ(hit->normal, (Vec3d{-1, 0, 0}));
  EXPECT_TRUE(ray_hit(test::ray_from({-4, 1, 1}, {1, 0, 0}), box).has_value());
  EXPECT_FALSE(ray_hit(test::ray_from({-4, std::nextafter(1.0, 2.0), 0}, {1, 0, 0}), box).has_value());
}

TEST(RayObbTest, EachInsideModeHasItsAnswerFromInside) {
  const Shape box = box_of({0, 0, 0}, {1, 2, 3});
  const Rayd ray = {{0, 1, 0}, {0, -2, 0}};
  const auto solid = ray_hit(ObjectRay(ray), box);
  EXPECT_EQ(solid->t, 0);
  EXPECT_EQ(solid->normal, (Vec3d{0, 1, 0}));
  const auto hollow = ray_hit(ObjectRay(ray, Inside::kHollow), box);
  EXPECT_EQ(hollow->t, 1.5);
  EXPECT_EQ(hollow->normal, (Vec3d{0, -1, 0}));
  EXPECT_FALSE(ray_hit(ObjectRay(ray, Inside::kSkip), box).has_value());
}

TEST(RayObbTest, ARotatedBoxIsHitOnItsRotatedFace) {
  const float sin_45 = std::sqrt(0.5f);  // a rotation of 90 degrees around z
  const Shape box = box_of({10, 0, 0}, {1, 2, 3}, {0, 0, sin_45, sin_45});
  const auto hit = ray_hit(test::ray_from({0, 0, 0}, {1, 0, 0}), box);
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->t, 8, 1e-14);
  EXPECT_NEAR(hit->normal.x, -1, 1e-15);
}

TEST(RayObbTest, FlatAndZeroSizeBoxesAreHit) {
  EXPECT_EQ(ray_hit(test::ray_from({0, 0, 0}, {1, 1, 0}), box_of({4, 4, 0}, {0, 1, 1}))->t, 4);
  const auto hit = ray_hit(test::ray_from({0, 0, 0}, {1, 2, 3}), box_of({2, 4, 6}, {0, 0, 0}));
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->t, 2);
  EXPECT_FALSE(ray_hit(test::ray_from({0, 0, 0}, {1, 2, 2.999}), box_of({2, 4, 6}, {0, 0, 0})).has_value());
}

}  // namespace
}  // namespace locus
