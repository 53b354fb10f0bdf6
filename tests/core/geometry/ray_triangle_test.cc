#include "core/geometry/ray_triangle.h"

#include <cstdint>

#include "gtest/gtest.h"
#include "tests/support/random.h"
#include "tests/support/real.h"

namespace locus {
namespace {

using test::Random;
using test::Real;
using test::to_real;
using test::Vec3r;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Intersection of a ray with a triangle's plane, computed in long double. `inset` is the distance of the intersection
// to the nearest edge, negative outside the triangle.
struct Reference {
  bool edge_on;
  Real t;
  Real inset;
};

Reference reference(Vec3d origin, Vec3d direction, const Triangle& triangle) {
  const Vec3r vertices[3] = {to_real(triangle.a), to_real(triangle.b), to_real(triangle.c)};
  const Vec3r normal = cross(vertices[1] - vertices[0], vertices[2] - vertices[0]);
  const Real speed = dot(normal, to_real(direction));
  if (speed == 0) return {true, 0, 0};
  const Real t = dot(normal, vertices[0] - to_real(origin)) / speed;
  const Vec3r point = to_real(origin) + to_real(direction) * t;
  Real inset = std::numeric_limits<Real>::infinity();
  for (int i = 0; i < 3; ++i) {
    const Vec3r edge = vertices[(i + 1) % 3] - vertices[i];
    inset =
        std::min(inset, dot(cross(normal, edge), point - vertices[i]) / (test::length(normal) * test::length(edge)));
  }
  return {false, t, inset};
}

Vec3d point_of(const Triangle& t, double u, double v) {
  return to_double(t.a) + (to_double(t.b) - to_double(t.a)) * u + (to_double(t.c) - to_double(t.a)) * v;
}

// If the ray starts in the triangle's plane, rounding errors of the edge functions can make the computed t slightly
// negative. The triangle must be hit nevertheless.
TEST(RayTriangleTest, ARayThatStartsOnAWallHitsItAtZeroInAnyDirection) {
  constexpr uint64_t kSeed = 57;
  Random random(kSeed);
  for (int i = 0; i < 100000; ++i) {
    const float x = random.float_between(-100, 100);
    const Triangle wall = {{x, random.float_between(-9, -7), random.float_between(-9, -7)},
                           {x, random.float_between(7, 9), random.float_between(-9, -7)},
                           {x, random.float_between(-1, 1), random.float_between(4, 9)}};
    const TriangleRay ray({x, random.between(-0.25, 0.25), random.between(-0.25, 0.25)}, random.unit_vector());
    const std::optional<TriangleHit> hit = ray.hit(wall);
    ASSERT_TRUE(hit.has_value()) << "seed " << kSeed << " case " << i;
    ASSERT_LE(hit->t, 1e-9f) << "seed " << kSeed << " case " << i;
  }
}

TEST(RayTriangleTest, ARayThatStartsVisiblyBehindATriangleMissesIt) {
  constexpr uint64_t kSeed = 58;
  Random random(kSeed);
  for (int i = 0; i < 100000; ++i) {
    const Triangle wall = {{1, -8, -8}, {1, 8, -8}, {1, 0, 8}};
    Vec3d direction = random.unit_vector();
    direction.x = std::max(std::abs(direction.x), 1e-3);
    const double behind = random.magnitude(-33, 0);
    const TriangleRay ray({1 + behind, random.between(-1, 1), random.between(-1, 1)}, direction);
    ASSERT_FALSE(ray.hit(wall).has_value()) << "seed " << kSeed << " case " << i;
  }
}

// Let e be 2^-20 (|origin| + extent of the triangle). If a ray crosses a triangle at least e inside the triangle's
// edges, hit() reports a hit whose distance is wrong by at most e / 4.
TEST(RayTriangleTest, NoMissAndNoLateHitAtAnyAngleAndDistance) {
  constexpr uint64_t kSeed = 51;
  Random random(kSeed);
  int hits = 0, misses = 0;
  for (int i = 0; i < 400000; ++i) {
    const double size = random.magnitude(-10, 10);
    Triangle triangle{random.float_vector(size), random.float_vector(size), random.float_vector(size), 0};
    const Vec3d origin = random.vector(size * random.magnitude(-4, 4));
    const Vec3d target = point_of(triangle, random.between(-0.5, 1), random.between(-0.5, 1));
    Vec3d direction = (target - origin) * random.magnitude(-40, 40);
    if (i % 2 == 0) direction = to_double(to_float(direction));
    const Reference expected = reference(origin, direction, triangle);
    if (expected.edge_on || expected.t < 0) continue;
    const double extent = magnitude(bounds_of(triangle));
    const Real e = 0x1p-20L * (test::length(to_real(origin)) + extent);
    const Real speed = test::length(to_real(direction));
    const TriangleRay ray(origin, direction);
    const std::optional<TriangleHit> hit = ray.hit(triangle);
    if (expected.inset >= e) {
      ++hits;
      ASSERT_TRUE(hit.has_value()) << "seed " << kSeed << " case " << i;
      ASSERT_LE(std::abs(ray.from_scaled(hit->t) - expected.t) * speed, 0.25L * e) << "seed " << kSeed << " case " << i;
    } else if (expected.inset < -e * 1e-6L) {
      ++misses;
      ASSERT_FALSE(hit.has_value()) << "seed " << kSeed << " case " << i;
    }
  }
  EXPECT_GT(hits, 50000);
  EXPECT_GT(misses, 50000);
}

TEST(RayTriangleTest, WeightsReproduceThePoint) {
  constexpr uint64_t kSeed = 52;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Triangle triangle{random.float_vector(1), random.float_vector(1), random.float_vector(1), 0};
    if (std::sqrt(squared_length(area_normal(triangle))) < 0.05) continue;
    const Vec3d origin = random.vector(5);
    double u = random.unit(), v = random.unit();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const TriangleRay ray(origin, point_of(triangle, u, v) - origin);
    const std::optional<TriangleHit> hit = ray.hit(triangle);
    if (!hit) continue;
    ASSERT_GE(hit->u, 0);
    ASSERT_GE(hit->v, 0);
    const Vec3d difference = point_of(triangle, hit->u, hit->v) - point_of(triangle, u, v);
    ASSERT_LT(std::sqrt(squared_length(difference)), 1e-6) << "seed " << kSeed << " case " << i;
  }
}

// Result of exact_verdict(), which computes signed volumes in integer arithmetic, without rounding.
enum class Exact { kMiss, kHit };

int64_t volume(const int64_t (&p)[3], const int64_t (&q)[3], const int64_t (&d)[3]) {
  return d[0] * (p[1] * q[2] - p[2] * q[1]) + d[1] * (p[2] * q[0] - p[0] * q[2]) + d[2] * (p[0] * q[1] - p[1] * q[0]);
}

Exact exact_verdict(const int64_t (&o)[3], const int64_t (&d)[3], const int64_t (&v)[3][3]) {
  int64_t p[3][3];
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis) p[i][axis] = v[i][axis] - o[axis];
  const int64_t ab = volume(p[0], p[1], d), bc = volume(p[1], p[2], d), ca = volume(p[2], p[0], d);
  const bool all_up = ab >= 0 && bc >= 0 && ca >= 0, all_down = ab <= 0 && bc <= 0 && ca <= 0;
  const int64_t sum = ab + bc + ca;
  if (!(all_up || all_down) || sum == 0) return Exact::kMiss;
  // `height` times the sign of `sum` is a positive multiple of the t at which the ray meets the triangle's plane.
  const int64_t height = volume(p[0], p[1], p[2]);
  return (sum > 0 ? height : -height) >= 0 ? Exact::kHit : Exact::kMiss;
}

TEST(RayTriangleTest, VerdictsOnIntegerRaysAreExact) {
  constexpr uint64_t kSeed = 53;
  Random random(kSeed);
  int hits = 0, grazing = 0;
  for (int i = 0; i < 400000; ++i) {
    int64_t o[3], d[3], v[3][3];
    Vec3d origin, direction;
    Vec3f vertices[3];
    for (int axis = 0; axis < 3; ++axis) {
      o[axis] = random.whole(-4, 4);
      d[axis] = random.whole(-3, 3);
      origin[axis] = static_cast<double>(o[axis]);
      direction[axis] = static_cast<double>(d[axis]);
      for (int k = 0; k < 3; ++k) {
        v[k][axis] = random.whole(-3, 3);
        vertices[k][axis] = static_cast<float>(v[k][axis]);
      }
    }
    if (direction == Vec3d{}) continue;
    const Triangle triangle{vertices[0], vertices[1], vertices[2], 0};
    const bool expected = exact_verdict(o, d, v) == Exact::kHit;
    const std::optional<TriangleHit> hit = TriangleRay(origin, direction).hit(triangle);
    ASSERT_EQ(hit.has_value(), expected) << "seed " << kSeed << " case " << i;
    hits += expected;
    grazing += hit && (hit->u == 0 || hit->v == 0 || hit->u + hit->v == 1);
  }
  EXPECT_GT(hits, 10000);
  EXPECT_GT(grazing, 2000);
}

TEST(RayTriangleTest, EdgeOnAndZeroAreaTrianglesAreNeverHit) {
  constexpr uint64_t kSeed = 54;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    // Makes a triangle whose vertices a, b and 2 b - a are whole numbers and exactly collinear.
    const Vec3d a = random.whole_vector(1000), b = random.whole_vector(1000);
    const Triangle needle{to_float(a), to_float(b), to_float(b * 2.0 - a), 0};
    const Vec3d origin = random.vector(3000);
    const Vec3d target = a + (b - a) * random.between(0, 2);
    ASSERT_FALSE(TriangleRay(origin, target - origin).hit(needle).has_value()) << "seed " << kSeed << " case " << i;
    // Makes a wall perpendicular to an axis, and a ray within its plane.
    Vec3d from = random.vector(10), to = random.vector(1) - from;
    Triangle wall{random.float_vector(1), random.float_vector(1), random.float_vector(1), 0};
    const int axis = static_cast<int>(random.below(3));
    const float plane = random.float_between(-1, 1);
    wall.a[axis] = wall.b[axis] = wall.c[axis] = plane;
    from[axis] = plane;
    to[axis] = 0;
    ASSERT_FALSE(TriangleRay(from, to).hit(wall).has_value()) << "seed " << kSeed << " case " << i;
  }
}

TEST(RayTriangleTest, CullModesFollowTheUploadedWinding) {
  const Triangle front{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0};  // counter-clockwise seen from +z
  const Vec3d above = {0.25, 0.25, 2}, below = {0.25, 0.25, -2};
  for (const auto& [origin, direction, is_front] :
       {std::tuple(above, Vec3d{0, 0, -1}, true), std::tuple(below, Vec3d{0, 0, 1}, false)}) {
    EXPECT_TRUE(TriangleRay(origin, direction).hit(front).has_value());
    EXPECT_EQ(TriangleRay(origin, direction, Cull::kBack).hit(front).has_value(), is_front);
    EXPECT_EQ(TriangleRay(origin, direction, Cull::kFront).hit(front).has_value(), !is_front);
  }
}

TEST(RayTriangleTest, CullModesFollowTheNormalFromEverySide) {
  constexpr uint64_t kSeed = 55;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Triangle triangle{random.float_vector(1), random.float_vector(1), random.float_vector(1), 0};
    const Vec3d origin = random.vector(5);
    const Vec3d direction = point_of(triangle, 0.3, 0.3) - origin;
    if (!TriangleRay(origin, direction).hit(triangle)) continue;
    const bool is_front = dot(area_normal(triangle), direction) < 0;
    ASSERT_EQ(TriangleRay(origin, direction, Cull::kBack).hit(triangle).has_value(), is_front)
        << "seed " << kSeed << " case " << i;
    ASSERT_EQ(TriangleRay(origin, direction, Cull::kFront).hit(triangle).has_value(), !is_front)
        << "seed " << kSeed << " case " << i;
  }
}

TEST(RayTriangleTest, OriginOnTheTriangleHitsAtZeroAndBehindItMisses) {
  const Triangle triangle{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, 0};
  const auto hit = TriangleRay({1, 1, 0}, {0, 0, 1}).hit(triangle);
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->t, 0);
  EXPECT_FALSE(std::signbit(hit->t));
  EXPECT_FALSE(TriangleRay({1, 1, 1e-6}, {0, 0, 1}).hit(triangle).has_value());
}

TEST(RayTriangleTest, TheHitDoesNotDependOnTheLengthOfTheDirection) {
  constexpr uint64_t kSeed = 56;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Triangle triangle{random.float_vector(1), random.float_vector(1), random.float_vector(1), 0};
    const Vec3d origin = random.vector(2);
    const Vec3d direction = point_of(triangle, random.between(-0.2, 0.8), random.between(-0.2, 0.8)) - origin;
    const int exponent = random.whole(-100, 100);  // factor of the direction, from about 1e-30 to 1e30
    const Vec3d longer = direction * std::ldexp(1.0, exponent);
    const TriangleRay one(origin, direction), other(origin, longer);
    const auto a = one.hit(triangle), b = other.hit(triangle);
    ASSERT_EQ(a.has_value(), b.has_value()) << "seed " << kSeed << " case " << i;
    if (!a) continue;
    ASSERT_EQ(a->u, b->u) << "seed " << kSeed << " case " << i;
    ASSERT_EQ(std::ldexp(one.from_scaled(a->t), -exponent), other.from_scaled(b->t))
        << "seed " << kSeed << " case " << i;
  }
}

TEST(RayTriangleTest, ToScaledNeverExcludesAHitThatFromScaledRoundsDown) {
  constexpr uint64_t kSeed = 57;
  Random random(kSeed);
  for (int i = 0; i < 100000; ++i) {
    const Vec3d direction = random.unit_vector() * random.magnitude(-110, 110);
    const TriangleRay ray({0, 0, 0}, direction);
    const float t = static_cast<float>(random.magnitude(-120, 120));
    ASSERT_GE(ray.to_scaled(ray.from_scaled(t)), t) << "seed " << kSeed << " case " << i;
    const float later = std::nextafter(t, kInfinity);
    ASSERT_LE(ray.from_scaled(t), ray.from_scaled(later)) << "seed " << kSeed << " case " << i;
    ASSERT_LE(ray.to_scaled(t), ray.to_scaled(later)) << "seed " << kSeed << " case " << i;
  }
}

TEST(RayTriangleTest, ScalingKeepsZeroInfinityAndTheLargestFloat) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  for (const double size : {1e-30, 1.0, 1e30}) {
    const TriangleRay ray({0, 0, 0}, {size, 0, 0});
    EXPECT_EQ(ray.from_scaled(0), 0);
    EXPECT_GE(ray.to_scaled(0), 0);
    EXPECT_EQ(ray.from_scaled(kInfinity), kInfinity);
    EXPECT_EQ(ray.to_scaled(kInfinity), kInfinity);
    EXPECT_EQ(ray.to_scaled(kLargest), kInfinity);
    EXPECT_LE(ray.from_scaled(kLargest), kLargest);
  }
}

TEST(RayTriangleTest, TheDistanceLiesWithinTheIntervalOfTheBounds) {
  constexpr uint64_t kSeed = 58;
  Random random(kSeed);
  for (int i = 0; i < 100000; ++i) {
    const Triangle triangle{random.float_vector(1), random.float_vector(1), random.float_vector(1), 0};
    const Vec3d origin = random.vector(random.magnitude(-3, 20));
    const TriangleRay ray(origin, point_of(triangle, 0.3, 0.3) - origin);
    const auto hit = ray.hit(triangle);
    if (!hit) continue;
    const Interval<float> own = ray.slabs().interval(bounds_of(triangle));
    ASSERT_LE(own.near, hit->t) << "seed " << kSeed << " case " << i;
    ASSERT_GE(own.far, hit->t) << "seed " << kSeed << " case " << i;
  }
}

}  // namespace
}  // namespace locus
