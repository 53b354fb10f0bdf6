// Tests of convex regions and their overlaps. The reference searches in long double for the point of the shape that is
// nearest to the region: the shape and the region overlap if this point is in the region.
#include "core/geometry/convex_region.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/random.h"
#include "tests/support/random_shape.h"
#include "tests/support/real.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using Planes = std::vector<Plane>;

Planes box_planes(Vec3d center, Vec3d half, const Rotation& rotation = {}) {
  Planes planes;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      Vec3d normal;
      normal[axis] = -side;
      normal = rotation.to_world(normal);
      planes.push_back(normalized_plane(normal, half[axis] - dot(normal, center)));
    }
  return planes;
}

// Returns the planes of a view from `eye` along the rotated x axis: a near plane, a far plane and four sides. Relative
// to `eye` and before the rotation, the sides bound |y| and |z| by `slope` * x.
Planes view_planes(Vec3d eye, double slope, double near, double far, const Rotation& rotation) {
  Planes planes;
  const auto add = [&](Vec3d normal, double offset) {
    const Vec3d n = rotation.to_world(normal);
    planes.push_back(normalized_plane(n, offset - dot(n, eye)));
  };
  add({1, 0, 0}, -near);
  add({-1, 0, 0}, far);
  for (const double side : {-1.0, 1.0}) {
    add({slope, side, 0}, 0);
    add({slope, 0, side}, 0);
  }
  return planes;
}

ConvexRegion region_of(const Planes& planes, Vec3d origin = {}) {
  const std::optional<ConvexRegion> region = ConvexRegion::make(origin, planes);
  LOCUS_CHECK(region.has_value());
  return *region;
}

Shape ball(Vec3d position, float radius) {
  Shape shape;
  shape.kind = radius == 0 ? ShapeKind::kPoint : ShapeKind::kBall;
  shape.position = position;
  shape.radius = radius;
  return shape;
}

Shape box(Vec3d position, Vec3f half, Quaternion rotation = {}) {
  Shape shape;
  shape.kind = ShapeKind::kBox;
  shape.position = position;
  shape.size = half;
  shape.rotation = rotation;
  return shape;
}

TEST(ConvexRegionTest, ABoxOfPlanesIsABox) {
  const ConvexRegion region = region_of(box_planes({1, 2, 3}, {1, 1, 1}));
  EXPECT_TRUE(region_overlaps(region, ball({2, 3, 4}, 0)));
  EXPECT_FALSE(region_overlaps(region, ball({2.001, 3, 4}, 0)));
  EXPECT_TRUE(region_overlaps(region, ball({4, 2, 3}, 2)));
  EXPECT_FALSE(region_overlaps(region, ball({4, 2, 3}, 1.999f)));
  // The centre of the first two balls is 5 away from an edge, by the offset (3, 4). The centre of the last two balls is
  // 7 away from a corner, by the offset (2, 3, 6).
  EXPECT_TRUE(region_overlaps(region, ball({5, 7, 3}, 5)));
  EXPECT_FALSE(region_overlaps(region, ball({5, 7, 3}, 4.999f)));
  EXPECT_TRUE(region_overlaps(region, ball({4, 6, 10}, 7)));
  EXPECT_FALSE(region_overlaps(region, ball({4, 6, 10}, 6.999f)));
}

TEST(ConvexRegionTest, APlaneThatTouchesIsWithin) {
  const ConvexRegion region = region_of(box_planes({0, 0, 0}, {1, 1, 1}));
  EXPECT_TRUE(region_overlaps(region, box({3, 0, 0}, {2, 1, 1})));
  EXPECT_FALSE(region_overlaps(region, box({3.001, 0, 0}, {2, 1, 1})));
}

TEST(ConvexRegionTest, ARegionWithoutAnInteriorPointIsNone) {
  Planes planes = box_planes({0, 0, 0}, {1, 1, 1});
  planes.push_back(normalized_plane({1, 0, 0}, -1));
  EXPECT_FALSE(ConvexRegion::make({}, planes).has_value());
  planes.back() = normalized_plane({1, 0, 0}, -2);
  EXPECT_FALSE(ConvexRegion::make({}, planes).has_value());
  planes.back() = normalized_plane({1, 0, 0}, -0.999);
  EXPECT_TRUE(ConvexRegion::make({}, planes).has_value());
  EXPECT_FALSE(ConvexRegion::make({}, Planes{normalized_plane({1, 0, 0}, -1e10)}).has_value());
}

TEST(ConvexRegionTest, SmallRegionsFarOutHaveTightBounds) {
  const Vec3d origin{5e8, -7e8, 3e8};
  const ConvexRegion region = region_of(box_planes({0.25, 0, 0}, {0.001, 0.002, 0.003}), origin);
  EXPECT_LT(max_component(region.bounds().extent()), 0.02);
  EXPECT_TRUE(region_overlaps(region, ball(origin + Vec3d{0.25, 0, 0}, 0)));
  EXPECT_FALSE(region_overlaps(region, ball(origin + Vec3d{0.26, 0, 0}, 0)));
}

TEST(ConvexRegionTest, AHalfSpaceReachesTheEdgeOfTheWorld) {
  const ConvexRegion region = region_of({normalized_plane({0, 0, 3}, -3)});
  EXPECT_TRUE(region_overlaps(region, ball({9e8, -9e8, 1}, 0)));
  EXPECT_TRUE(region_overlaps(region, ball({1e9, 1e9, 1e9}, 0)));
  EXPECT_FALSE(region_overlaps(region, ball({9e8, -9e8, 0.999}, 0)));
}

TEST(ConvexRegionTest, ARegionInsideOfABoxOverlapsIt) {
  const ConvexRegion region = region_of(box_planes({1, 1, 1}, {0.1, 0.1, 0.1}));
  EXPECT_TRUE(region_overlaps(region, box({0, 0, 0}, {5, 5, 5})));
  EXPECT_FALSE(region_overlaps(region, box({-6, 0, 0}, {5, 5, 5})));
}

// Returns the point of the region nearest to `point` in long double, by Dykstra's alternating projections.
// Source: Boyle, Dykstra, A Method for Finding Projections onto the Intersection of Convex Sets in Hilbert Spaces,
// 1986.
Vec3r projected(const ConvexRegion& region, Vec3r point) {
  std::vector<Vec3r> corrections(region.planes().size());
  Vec3r at = point;
  for (int round = 0; round < 400; ++round) {
    const Vec3r before = at;
    for (size_t i = 0; i < corrections.size(); ++i) {
      const Plane& plane = region.planes()[i];
      const Vec3r from = at + corrections[i], normal = to_real(plane.normal);
      const Real value = dot(normal, from) + Real{plane.offset};
      at = value < 0 ? from - normal * value : from;
      corrections[i] = from - at;
    }
    if (length(at - before) < 1e-13L * (1 + length(point)) && round > 20) break;
  }
  return at;
}

// Returns the distance from the shape's core to the region, by alternating projections. The core is the point, the
// centre of a ball, the solid of a box, or the inner segment of a capsule.
Real core_distance(const ConvexRegion& region, const Shape& shape) {
  const auto distance_of = [&](Vec3r local) {
    const Vec3r point = to_real(shape.position) + turned(shape.rotation, local);
    return length(projected(region, point) - point);
  };
  if (shape.kind == ShapeKind::kPoint || shape.kind == ShapeKind::kBall) return distance_of({});
  // The distance is convex, so alternating projections onto the region and the core converge to the least distance.
  Vec3r local;
  Real best = distance_of(local);
  for (int round = 0; round < 3000; ++round) {
    const Vec3r before = local;
    const Vec3r point = to_real(shape.position) + turned(shape.rotation, local);
    const Vec3r wanted = turned_back(shape.rotation, projected(region, point) - to_real(shape.position));
    const Vec3r size = to_real(to_double(shape.size));
    if (shape.kind == ShapeKind::kBox) {
      for (int axis = 0; axis < 3; ++axis) local[axis] = std::clamp(wanted[axis], -size[axis], size[axis]);
    } else {
      const Real squared = dot(size, size);
      local = size * (squared == 0 ? Real{0} : std::clamp(dot(wanted, size) / squared, Real{-1}, Real{1}));
    }
    best = std::min(best, distance_of(local));
    if (length(local - before) < 1e-9L || best < 1e-9L) break;
  }
  return best;
}

TEST(ConvexRegionTest, RandomShapesOverlapWhereTheyShareAPoint) {
  size_t overlapping = 0, apart = 0, unsure = 0;
  for (uint64_t seed = 0; seed < scaled_count(500); ++seed) {
    Random random(seed);
    const Rotation rotation = rotation_of(random.rotation());
    const Planes planes =
        random.chance(0.5) ? box_planes(random.vector(3), random.positive_vector(2) + Vec3d{0.1, 0.1, 0.1}, rotation)
                           : view_planes(random.vector(3), random.between(0.2, 2), 0.1, random.between(1, 8), rotation);
    const ConvexRegion region = region_of(planes);
    Shape shape = random_shape(random, random.pick(kShapeKinds), 5);
    for (int axis = 0; axis < 3; ++axis) shape.size[axis] = random.float_between(0, 2);
    shape.radius = random.float_between(0.1, 2);
    if (shape.kind == ShapeKind::kPoint) shape.radius = 0;
    const Real radius = shape.kind == ShapeKind::kBox ? Real{0} : Real{shape.radius};
    const Real distance = core_distance(region, shape) - radius;
    const bool found = region_overlaps(region, shape);
    (found ? overlapping : apart) += 1;
    // The reference is too imprecise to decide closer cases.
    if (std::abs(distance) < 1e-3L) {
      ++unsure;
      continue;
    }
    ASSERT_EQ(found, distance < 0 || core_distance(region, shape) < 1e-6L)
        << "seed " << seed << ", " << double(distance);
  }
  EXPECT_GT(overlapping, scaled_count(40));
  EXPECT_GT(apart, scaled_count(70));
  EXPECT_LT(unsure, scaled_count(300));
}

TEST(ConvexRegionTest, RandomTrianglesOverlapWhereTheyShareAPoint) {
  size_t overlapping = 0, apart = 0;
  for (uint64_t seed = 0; seed < scaled_count(1'000); ++seed) {
    Random random(seed);
    const ConvexRegion region = region_of(view_planes(random.vector(3), random.between(0.2, 2), 0.1,
                                                      random.between(1, 8), rotation_of(random.rotation())));
    const Vec3d center = random.vector(3);
    const Triangle triangle{to_float(center + random.vector(2)), to_float(center + random.vector(2)),
                            to_float(center + random.vector(2)), 0};
    const Transform none = make_transform({}, {}, 1);
    const bool found = RegionInMesh(region, none, 10).overlaps(triangle);
    // Find the least distance from the region to the points of a fine barycentric grid in the triangle.
    Real best = 1e9L;
    constexpr int kSteps = 24;
    for (int u = 0; u <= kSteps; ++u)
      for (int v = 0; u + v <= kSteps; ++v) {
        const Real s = Real{1} * u / kSteps, t = Real{1} * v / kSteps;
        const Vec3r point = to_real(triangle.a) * (1 - s - t) + to_real(triangle.b) * s + to_real(triangle.c) * t;
        best = std::min(best, length(projected(region, point) - point));
      }
    (found ? overlapping : apart) += 1;
    // A grid point within the region proves an overlap. Every point of the triangle is less than 8 / kSteps away from a
    // grid point. So if the triangle and the region share a point, a grid point is less than 8 / kSteps away from the
    // region.
    ASSERT_TRUE(found || best > 1e-9L) << "seed " << seed;
    ASSERT_TRUE(!found || best < 8.0L / kSteps) << "seed " << seed;
  }
  EXPECT_GT(overlapping, scaled_count(100));
  EXPECT_GT(apart, scaled_count(100));
}

TEST(ConvexRegionTest, TheSideOfABallAgreesWithItsOverlap) {
  for (uint64_t seed = 0; seed < scaled_count(20'000); ++seed) {
    Random random(seed);
    const Vec3d origin = random.chance(0.5) ? Vec3d{} : random.vector(1e8);
    const ConvexRegion region = region_of(
        view_planes(random.vector(3), random.between(0.2, 2), 0.1, 5, rotation_of(random.rotation())), origin);
    const Shape shape = ball(origin + random.vector(6), static_cast<float>(random.between(0.01, 3)));
    const RegionSide side = side_of_ball(region, shape.position, double{shape.radius}, 0);
    if (side == RegionSide::kUndecided) continue;
    ASSERT_EQ(region_overlaps(region, shape), side == RegionSide::kInside) << "seed " << seed;
  }
}

TEST(ConvexRegionTest, ThePlanesNearABoxDecideTheSideOfItsBalls) {
  size_t all = 0, some = 0, none = 0, outside = 0;
  for (uint64_t seed = 0; seed < scaled_count(5'000); ++seed) {
    Random random(seed);
    const Vec3d origin = random.chance(0.5) ? Vec3d{} : random.vector(1e8);
    const ConvexRegion region = region_of(
        view_planes(random.vector(3), random.between(0.2, 2), 0.1, 5, rotation_of(random.rotation())), origin);
    const double half = random.between(0, 1) * random.between(0, 3), radius = random.between(0, 0.5);
    const Vec3d middle = origin + random.vector(6);
    const Aabbd box = {middle - Vec3d{half, half, half}, middle + Vec3d{half, half, half}};
    const NearPlanes near = near_planes(region, box, radius, 0);
    const auto planes = static_cast<size_t>(__builtin_popcountll(near.planes));
    ++(near.outside ? outside : planes == 0 ? none : planes == region.planes().size() ? all : some);
    for (int i = 0; i < 30; ++i) {
      // Includes the corners, which are the extreme centres.
      const Vec3d at =
          i < 8 ? Vec3d{i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half}
                : Vec3d{random.between(-half, half), random.between(-half, half), random.between(-half, half)};
      const Vec3d center = max(box.min, min(middle + at, box.max));
      const double own = i % 2 == 0 ? radius : random.between(0, radius);
      const RegionSide side = side_of_ball(region, center, own, 0);
      const RegionSide found = near.outside ? RegionSide::kOutside : side_of_ball(region, near.planes, center, own, 0);
      ASSERT_EQ(found, side) << "seed " << seed;
    }
  }
  EXPECT_GT(std::min({some, none, outside}), scaled_count(100)) << all;
}

}  // namespace
}  // namespace locus::test
