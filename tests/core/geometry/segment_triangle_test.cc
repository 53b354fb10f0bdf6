#include "core/geometry/segment_triangle.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/geometry/vec3.h"
#include "tests/support/random.h"

namespace locus {
namespace {

using test::Random;

// Returns the point of the triangle's plane with these barycentric coordinates.
Vec3d in_plane(Vec3d a, Vec3d b, Vec3d c, double v, double w) { return a + (b - a) * v + (c - a) * w; }

TEST(SegmentTriangleTest, ASegmentInThePlaneDoesNotCrossADistantTriangle) {
  constexpr uint64_t kSeed = 20261127;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Vec3d a = random.vector(1000), b = a + random.vector(10), c = a + random.vector(10);
    // Both ends are beyond the edge bc, at twice its distance from a.
    const double v = random.between(-3, 3), w = random.between(-3, 3);
    const Vec3d start = in_plane(a, b, c, v, 2 - v), end = in_plane(a, b, c, w, 2 - w);
    const Vec3d center = (start + end) * 0.5, half_axis = (end - start) * 0.5;
    const double height = std::sqrt(squared_length(cross(b - a, c - a)) / squared_length(c - b));
    EXPECT_FALSE(segment_crosses_triangle(center, half_axis, a, b, c)) << "seed " << kSeed << " case " << i;
    EXPECT_GE(squared_distance_segment_triangle(center, half_axis, a, b, c), height * height * 0.99)
        << "seed " << kSeed << " case " << i;
  }
}

// The segment is much longer than the edges, so that the volumes of the edges are rounding errors, and tilted by so
// little that the volumes of its ends are not.
TEST(SegmentTriangleTest, ALongSegmentAlmostInThePlaneDoesNotCrossADistantTriangle) {
  constexpr uint64_t kSeed = 20261127;
  Random random(kSeed);
  for (int i = 0; i < 100000; ++i) {
    const Vec3d a = random.vector(50), b = a + random.vector(0.01), c = a + random.vector(0.01);
    const Vec3d normal = normalized(cross(b - a, c - a)), along = normalized(b - a), across = cross(normal, along);
    const Vec3d center = a + along * random.between(-50, 50) + across * random.between(5, 50);
    const Vec3d half_axis = along * 100 + normal * std::exp2(random.between(-40, -26));
    EXPECT_FALSE(segment_crosses_triangle(center, half_axis, a, b, c)) << "seed " << kSeed << " case " << i;
  }
}

TEST(SegmentTriangleTest, ASegmentInThePlaneThatMeetsTheTriangleHasDistanceZeroUpToRounding) {
  constexpr uint64_t kSeed = 20261127;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Vec3d a = random.vector(1000), b = a + random.vector(10), c = a + random.vector(10);
    const double v = random.between(0, 0.5), w = random.between(0, 0.5);
    const Vec3d start = in_plane(a, b, c, v, w), end = in_plane(a, b, c, random.between(-3, 3), random.between(-3, 3));
    const double squared = squared_distance_segment_triangle((start + end) * 0.5, (end - start) * 0.5, a, b, c);
    EXPECT_LE(squared, 1e-22) << "seed " << kSeed << " case " << i;
  }
}

TEST(SegmentTriangleTest, ASegmentThatCrossesAtASmallAngleHasDistanceZeroUpToRounding) {
  constexpr uint64_t kSeed = 20261127;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Vec3d a = random.vector(1000), b = a + random.vector(10), c = a + random.vector(10);
    const double v = random.between(0, 0.5), w = random.between(0, 0.5);
    const Vec3d along = in_plane({}, b - a, c - a, random.between(-1, 1), random.between(-1, 1));
    const Vec3d off = normalized(cross(b - a, c - a)) * std::exp2(random.between(-50, 0));
    const Vec3d center = in_plane(a, b, c, v, w);
    EXPECT_LE(squared_distance_segment_triangle(center, along + off, a, b, c), 1e-22)
        << "seed " << kSeed << " case " << i;
  }
}

TEST(SegmentTriangleTest, ASegmentThroughTheTriangleCrossesIt) {
  constexpr uint64_t kSeed = 20261127;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Vec3d a = random.vector(1000), b = a + random.vector(10), c = a + random.vector(10);
    const double v = random.between(0.01, 0.49), w = random.between(0.01, 0.49);
    const Vec3d off = normalized(cross(b - a, c - a)) * random.between(0.1, 10);
    EXPECT_TRUE(segment_crosses_triangle(in_plane(a, b, c, v, w), off, a, b, c)) << "seed " << kSeed << " case " << i;
    EXPECT_FALSE(segment_crosses_triangle(in_plane(a, b, c, -v, w), off, a, b, c)) << "seed " << kSeed << " case " << i;
  }
}

// A segment that crosses the diagonal of a parallelogram crosses one of the parallelogram's two triangles.
TEST(SegmentTriangleTest, NoSegmentPassesBetweenTwoTriangles) {
  constexpr uint64_t kSeed = 143;
  Random random(kSeed);
  for (int i = 0; i < 100000; ++i) {
    const Vec3d a = random.vector(10), c = random.vector(10), b = random.vector(10), d = a + c - b;
    const Vec3d on_diagonal = a + (c - a) * random.between(0.01, 0.99);
    const Vec3d half_axis = random.vector(random.magnitude(0, 5));
    const double sine = std::abs(dot(normalized(cross(c - a, b - a)), normalized(half_axis)));
    if (!(sine > 1e-3)) continue;
    const Vec3d center = on_diagonal + half_axis * random.between(-0.5, 0.5);
    ASSERT_TRUE(segment_crosses_triangle(center, half_axis, a, b, c) ||
                segment_crosses_triangle(center, half_axis, c, d, a) ||
                segment_crosses_triangle(center, half_axis, a, c, d))
        << "seed " << kSeed << " case " << i;
  }
}

}  // namespace
}  // namespace locus
