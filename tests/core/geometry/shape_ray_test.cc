// Tests of rays and shapes: compares hit or miss, distance and normal with a reference that finds the chord (the ray's
// interval in the solid) by numerical search.
#include <array>
#include <iomanip>
#include <sstream>
#include <string>

#include "core/geometry/shape.h"
#include "gtest/gtest.h"
#include "tests/support/convex_reference.h"
#include "tests/support/random_shape.h"

namespace locus {
namespace {

using test::Random;
using test::Real;
using test::RealInterval;
using test::SolidReference;
using test::to_real;
using test::Vec3r;

constexpr std::array<ShapeKind, 3> kSolids = {ShapeKind::kBall, ShapeKind::kBox, ShapeKind::kCapsule};
constexpr std::array<Inside, 3> kModes = {Inside::kSolid, Inside::kHollow, Inside::kSkip};

// Ray and shape, with the values from which the reference computes the expected hit. Distances are in world units, not
// in multiples of the direction's length.
struct RayCase {
  Shape shape;
  Rayd ray;
  Real tolerance;
  Vec3r offset, unit;
  Real speed, max_distance;
  Real inside_gauge;  // SolidReference::gauge() of the ray's origin, negative inside

  RayCase(const Shape& s, const Rayd& r) : shape(s), ray(r) {
    offset = to_real(r.origin) - to_real(s.position);
    speed = test::length(to_real(r.direction));
    unit = to_real(r.direction) * (1 / speed);
    const Real near = test::length(offset) + test::largest_size(s);
    max_distance = 2 * near;
    tolerance = 1e-12L * near + 1e-15L * test::length(to_real(s.position));
    inside_gauge = SolidReference(s).gauge(offset);
  }
  std::optional<RealInterval> chord(Real grown) const {
    return SolidReference(shape).chord(offset, unit, max_distance, grown);
  }
};

// Expects that the hit is between the beginning of the outer chord and the beginning of the inner chord. The outer
// chord is the chord of the solid grown by the tolerance, the inner chord is the chord of the solid shrunk by the
// tolerance. If there is no inner chord, a hit is optional and may be anywhere on the outer chord.
void expect_entry(const RayCase& c, const std::optional<ShapeHit>& hit) {
  const std::optional<RealInterval> outer = c.chord(c.tolerance), inner = c.chord(-c.tolerance);
  if (!outer || outer->far < 0) {
    EXPECT_FALSE(hit.has_value());
    return;
  }
  if (inner && inner->near >= 0) {
    ASSERT_TRUE(hit.has_value());
  }
  if (!hit) return;
  const Real s = Real{hit->t} * c.speed;
  const Real epsilon = 1e-15L * c.max_distance;
  EXPECT_GE(s, outer->near - epsilon);
  EXPECT_LE(s, (inner ? inner->near : outer->far) + epsilon);
}

void expect_exit(const RayCase& c, const std::optional<ShapeHit>& hit) {
  ASSERT_TRUE(hit.has_value());
  const std::optional<RealInterval> outer = c.chord(c.tolerance), inner = c.chord(-c.tolerance);
  ASSERT_TRUE(outer.has_value());
  const Real s = Real{hit->t} * c.speed;
  const Real epsilon = 1e-15L * c.max_distance;
  EXPECT_LE(s, outer->far + epsilon);
  if (inner) {
    EXPECT_GE(s, inner->far - epsilon);
  }
}

// Expects that a step along the normal increases the distance from the solid by the length of the step.
void expect_outward_normal(const RayCase& c, const ShapeHit& hit) {
  EXPECT_NEAR(static_cast<double>(test::length(to_real(hit.normal))), 1.0, 1e-12);
  const SolidReference solid(c.shape);
  const Vec3r point = c.offset + c.unit * (Real{hit.t} * c.speed);
  const Real thickness = solid.core_radius() > 0 ? solid.core_radius() : Real(test::largest_size(c.shape));
  if (c.shape.kind == ShapeKind::kCapsule && c.shape.radius == 0) return;
  if (thickness < 1e4L * c.tolerance) return;
  const Real step = 0.01L * thickness;
  const Real gain = solid.gauge(point + to_real(hit.normal) * step) - solid.gauge(point);
  EXPECT_NEAR(static_cast<double>(gain / step), 1.0, 1e-6 + static_cast<double>(20 * c.tolerance / step));
}

void expect_from_inside(const RayCase& c, Inside mode, const std::optional<ShapeHit>& hit) {
  if (mode == Inside::kSkip) {
    EXPECT_FALSE(hit.has_value());
  } else if (mode == Inside::kHollow) {
    expect_exit(c, hit);
  } else {
    ASSERT_TRUE(hit.has_value());
    EXPECT_EQ(hit->t, 0);
    EXPECT_NEAR(static_cast<double>(test::length(to_real(hit->normal) + c.unit)), 0.0, 1e-14);
  }
}

std::string described(const Shape& shape, const Rayd& ray, Inside mode, uint64_t seed, int index) {
  std::ostringstream text;
  text << std::setprecision(17) << "seed " << seed << " case " << index << " kind " << static_cast<int>(shape.kind)
       << " mode " << static_cast<int>(mode) << " radius " << shape.radius;
  const auto add = [&text](const char* name, auto v) {
    text << ' ' << name << " (" << v.x << ' ' << v.y << ' ' << v.z << ')';
  };
  add("position", shape.position);
  add("size", shape.size);
  add("origin", ray.origin);
  add("direction", ray.direction);
  return text.str();
}

class ShapeRayTest : public testing::TestWithParam<ShapeKind> {};

TEST_P(ShapeRayTest, RandomRaysAgreeWithTheReference) {
  constexpr uint64_t kSeed = 101;
  Random random(kSeed + static_cast<uint64_t>(GetParam()));
  int hits = 0, inside = 0;
  for (int i = 0; i < 20000 && !HasFailure(); ++i) {
    const Shape shape = test::random_shape(random, GetParam(), i % 4 == 0 ? 1e6 : 10);
    const Rayd ray = test::random_ray(random, shape, test::largest_size(shape) + 1e-3);
    const Inside mode = kModes[random.below(3)];
    SCOPED_TRACE(described(shape, ray, mode, kSeed, i));
    const RayCase c(shape, ray);
    const std::optional<ShapeHit> hit = ray_hit(ObjectRay(ray, mode), shape);
    hits += hit.has_value();
    if (c.inside_gauge < -c.tolerance) {
      ++inside;
      expect_from_inside(c, mode, hit);
    } else if (c.inside_gauge > c.tolerance) {
      expect_entry(c, hit);
    }
    if (hit && (mode == Inside::kHollow || c.inside_gauge > c.tolerance)) expect_outward_normal(c, *hit);
  }
  EXPECT_GT(hits, 3000);
  EXPECT_GT(inside, 500);
}

// Compares verdicts with a reference for the shape grown by 1e-9. This reference is exact, because shapes and rays have
// whole coordinates here: a ray that comes within 1e-9 of a shape touches the shape.
TEST_P(ShapeRayTest, LatticeVerdictsAreExact) {
  constexpr uint64_t kSeed = 202;
  constexpr Real kGrown = 1e-9L;
  Random random(kSeed + static_cast<uint64_t>(GetParam()));
  int touching = 0;
  for (int i = 0; i < 30000 && !HasFailure(); ++i) {
    Shape shape = test::lattice_shape(random, GetParam(), 4);
    Rayd ray = {random.whole_vector(9), random.whole_vector(3)};
    if (i % 3 == 0) ray = test::tangent_ray(random, shape);
    if (ray.direction == Vec3d{}) ray.direction = {0, 1, 0};
    SCOPED_TRACE(described(shape, ray, Inside::kSolid, kSeed, i));
    const RayCase c(shape, ray);
    const std::optional<RealInterval> outer = c.chord(kGrown);
    const bool starts_inside = c.inside_gauge <= kGrown;
    const bool expected = starts_inside || (outer && outer->far >= 0);
    const std::optional<ShapeHit> hit = ray_hit(ObjectRay(ray), shape);
    ASSERT_EQ(hit.has_value(), expected);
    ASSERT_EQ(ray_hit(ObjectRay(ray, Inside::kSkip), shape).has_value(), expected && !starts_inside);
    if (starts_inside) {
      ASSERT_EQ(hit->t, 0);
      ASSERT_TRUE(ray_hit(ObjectRay(ray, Inside::kHollow), shape).has_value());
    }
    touching += expected && !c.chord(-kGrown);
  }
  EXPECT_GT(touching, 200);
}

TEST_P(ShapeRayTest, ScalingTheDirectionByAPowerOfTwoKeepsTheHit) {
  constexpr uint64_t kSeed = 303;
  Random random(kSeed);
  for (int i = 0; i < 10000; ++i) {
    const Shape shape = test::random_shape(random, GetParam(), 100);
    const Rayd ray = test::random_ray(random, shape, test::largest_size(shape) + 1e-3);
    const int exponent = random.whole(-100, 100);
    const Rayd scaled = {ray.origin,
                         {std::ldexp(ray.direction.x, exponent), std::ldexp(ray.direction.y, exponent),
                          std::ldexp(ray.direction.z, exponent)}};
    const auto a = ray_hit(ObjectRay(ray, Inside::kHollow), shape);
    const auto b = ray_hit(ObjectRay(scaled, Inside::kHollow), shape);
    ASSERT_EQ(a.has_value(), b.has_value()) << "seed " << kSeed << " case " << i;
    if (!a) continue;
    ASSERT_EQ(std::ldexp(a->t, -exponent), b->t) << "seed " << kSeed << " case " << i;
    ASSERT_EQ(a->normal, b->normal) << "seed " << kSeed << " case " << i;
  }
}

TEST_P(ShapeRayTest, TheDistanceLiesWithinTheIntervalOfTheBounds) {
  constexpr uint64_t kSeed = 404;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Shape shape = test::random_shape(random, GetParam(), 1e4);
    const ObjectRay ray(test::random_ray(random, shape, test::largest_size(shape) + 1e-3), kModes[random.below(3)]);
    const std::optional<ShapeHit> hit = ray_hit(ray, shape);
    if (!hit) continue;
    const Interval<double> own = ray.slabs().interval(bounds_of(shape));
    ASSERT_LE(own.near, hit->t) << "seed " << kSeed << " case " << i;
    ASSERT_GE(own.far, hit->t) << "seed " << kSeed << " case " << i;
    ASSERT_GE(hit->t, 0) << "seed " << kSeed << " case " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(EverySolid, ShapeRayTest, testing::ValuesIn(kSolids));

TEST(ShapeRayPointTest, PointsAreNeverHit) {
  const Shape point{ShapeKind::kPoint, {1, 2, 3}, {}, {}, 0};
  for (const Inside mode : kModes) {
    EXPECT_FALSE(ray_hit(test::ray_from({0, 0, 0}, {1, 2, 3}, mode), point).has_value());
    EXPECT_FALSE(ray_hit(test::ray_from({1, 2, 3}, {1, 0, 0}, mode), point).has_value());
  }
}

}  // namespace
}  // namespace locus
