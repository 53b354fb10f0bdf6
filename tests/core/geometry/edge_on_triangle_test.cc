#include "core/geometry/edge_on_triangle.h"

#include "core/geometry/ray_triangle.h"
#include "gtest/gtest.h"
#include "tests/support/edge_on_cases.h"
#include "tests/support/quad.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus {
namespace {

using test::Quad;
using test::Random;
using test::Vec3q;

TEST(EdgeOnTriangleTest, CasesFoundByTheProofAgreeWithTheReference) { EXPECT_EQ(test::edge_on_difference(), ""); }

// Triangle, its transform, and a ray almost within the triangle's plane: the sine of the angle between the ray and the
// plane can be below 2^-60.
struct Grazing {
  Triangle triangle;
  Transform transform;
  Vec3d origin, direction;
};

Vec3d random_point_in(const Triangle& triangle, Random& random) {
  const double u = random.unit(), v = random.unit() * (1 - u);
  return to_double(triangle.a) * (1 - u - v) + to_double(triangle.b) * u + to_double(triangle.c) * v;
}

Triangle any_triangle(double size, Random& random) {
  const Vec3d off = random.chance(0.5) ? Vec3d{} : random.vector(size * random.magnitude(0, 14));
  const auto corner = [&] { return to_float(random.vector(size) + off); };
  return {corner(), corner(), corner(), 0};
}

Grazing any_grazing(Random& random) {
  const double size = random.magnitude(-8, 8);
  Grazing grazing{any_triangle(size, random), {}, {}, {}};
  Triangle& triangle = grazing.triangle;
  // If the triangle is perpendicular to an axis and the instance is not rotated, a ray can be arbitrarily close to
  // edge-on.
  const bool across = random.chance(0.5);
  const auto axis = static_cast<int>(random.below(3));
  if (across) triangle.b[axis] = triangle.c[axis] = triangle.a[axis];
  const Quaternion rotation = across ? Quaternion{} : random.rotation();
  grazing.transform = make_transform(random.chance(0.3) ? Vec3d{} : random.vector(random.magnitude(-5, 20)), rotation,
                                     random.chance(0.5) ? 1.0f : static_cast<float>(random.magnitude(-10, 10)));
  const Vec3d target = random_point_in(triangle, random);
  const Vec3d along = normalized(random_point_in(triangle, random) - target);
  const Vec3d aside = normalized(area_normal(triangle));
  const double back = size * (random.chance(0.2) ? -0.1 : random.magnitude(-4, 6));
  const Vec3d way = along + aside * random.magnitude(-50, -10);
  const Vec3d from = target - way * back + aside * (size * random.between(-1, 1) * random.magnitude(-55, -15));
  grazing.origin = grazing.transform.point_to_world(from);
  Vec3f direction = to_float(grazing.transform.rotation.to_world(way) * random.magnitude(-10, 10));
  if (across) direction[axis] = static_cast<float>(random.between(-1, 1) * random.magnitude(-60, -20));
  grazing.direction = to_double(direction);
  return grazing;
}

// Let e be the tolerance that tests/support/proof/ray_judge.h defines. A ray that crosses a triangle at least e inside
// the triangle's border must hit the triangle, unless it is culled. No hit may be farther than e / 2 from the triangle.
TEST(EdgeOnTriangleTest, HitsAreWithinTheToleranceAtEveryAngle) {
  constexpr uint64_t kSeed = 92;
  Random random(kSeed);
  int hits = 0, flat = 0;
  for (uint64_t i = 0; i < test::scaled_count(40'000); ++i) {
    const Grazing grazing = any_grazing(random);
    const Cull cull = random.chance(0.6) ? Cull::kNone : random.chance(0.5) ? Cull::kBack : Cull::kFront;
    if (area_normal(grazing.triangle) == Vec3d{}) continue;
    const TriangleRay ray(grazing.transform, grazing.origin, grazing.direction, cull);
    const std::optional<TriangleHit> hit = ray.hit(grazing.triangle);
    const Vec3q origin = test::turned_to_mesh(
        grazing.transform, test::to_quad(grazing.origin) - test::to_quad(grazing.transform.translation));
    const Vec3q direction = test::turned_to_mesh(grazing.transform, test::to_quad(grazing.direction));
    const Quad e = Quad{0x1p-20} * (test::length(origin) + magnitude(bounds_of(grazing.triangle)));
    const Quad speed = test::length(direction), t = hit ? Quad{ray.from_scaled(hit->t)} : Quad{-1};
    const test::QuadTriangle triangle(grazing.triangle);
    const test::QuadMeeting meeting = triangle.meet(origin, direction);
    const bool culled = cull != Cull::kNone && (cull == Cull::kBack) == (meeting.slope > 0);
    if (meeting.t >= 0 && meeting.inset >= e && !culled) {
      ASSERT_TRUE(hit.has_value()) << "seed " << kSeed << " case " << i;
      ASSERT_LE(static_cast<double>((t - meeting.t) * speed / e), 0.5) << "seed " << kSeed << " case " << i;
      flat += std::abs(static_cast<double>(meeting.slope / speed)) < 0x1p-34;
    }
    if (!hit) continue;
    ++hits;
    ASSERT_FALSE(culled) << "seed " << kSeed << " case " << i;
    ASSERT_LE(static_cast<double>(triangle.distance(origin + direction * t) / e), 0.5)
        << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(hits, static_cast<int>(test::scaled_count(40'000) / 10));
  EXPECT_GT(flat, static_cast<int>(test::scaled_count(40'000) / 400));
}

// Fixture with a triangle almost perpendicular to x and a ray along z. The triangle's border is 2^-60 away from the
// ray, a distance that the test in double cannot resolve.
class BesideTheBorderTest : public ::testing::Test {
 protected:
  std::optional<EdgeOnHit> hit(bool hit_in_double, Cull cull = Cull::kNone, double depth = 0) const {
    const StoredRay ray = {{0, -0x1p-60, depth}, {0, 0, 0.5}, {}, {}, 1};
    return edge_on_hit(ray, {{0, 0, 2}, {0x1p-50f, 0, 4}, {0, 3, 3}, 0}, cull, {hit_in_double, 0x1p-40});
  }
};

TEST_F(BesideTheBorderTest, AMissInDoubleIsAMiss) { EXPECT_FALSE(hit(false)); }

TEST_F(BesideTheBorderTest, AHitInDoubleIsAHitAtTheNearestPointOfTheBorder) {
  const std::optional<EdgeOnHit> found = hit(true);
  ASSERT_TRUE(found.has_value());
  EXPECT_GE(found->t, 4);
  EXPECT_LE(found->t, 8);
  EXPECT_EQ(found->v, 0);
}

TEST_F(BesideTheBorderTest, ABorderBehindTheOriginIsMissed) { EXPECT_FALSE(hit(true, Cull::kNone, 5)); }

TEST_F(BesideTheBorderTest, CullingHidesExactlyOneSide) {
  EXPECT_NE(hit(true, Cull::kBack).has_value(), hit(true, Cull::kFront).has_value());
}

TEST(EdgeOnTriangleTest, AnExactlyEdgeOnTriangleHasNoVisibleSide) {
  const StoredRay ray = {{0, 0, 0}, {0, 0, 0.5}, {}, {}, 1};
  const Triangle wall = {{0, -1, 2}, {0, 1, 2}, {0, 0, 4}, 0};
  EXPECT_FALSE(edge_on_hit(ray, wall, Cull::kNone, {false, 0x1p-40}));
  EXPECT_FALSE(edge_on_hit(ray, wall, Cull::kBack, {true, 0x1p-40}));
  EXPECT_FALSE(edge_on_hit(ray, wall, Cull::kFront, {true, 0x1p-40}));
}

}  // namespace
}  // namespace locus
