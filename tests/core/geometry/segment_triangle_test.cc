#include "core/geometry/segment_triangle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/geometry/vec3.h"

namespace locus {
namespace {

class SegmentTriangleTest : public testing::Test {
 protected:
  double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Vec3d point(double limit) { return {number(-limit, limit), number(-limit, limit), number(-limit, limit)}; }

  std::mt19937_64 random_{20261127};
};

// The point of the triangle's plane with these barycentric coordinates.
Vec3d in_plane(Vec3d a, Vec3d b, Vec3d c, double v, double w) { return a + (b - a) * v + (c - a) * w; }

TEST_F(SegmentTriangleTest, ASegmentInThePlaneDoesNotCrossADistantTriangle) {
  for (int i = 0; i < 20000; ++i) {
    const Vec3d a = point(1000), b = a + point(10), c = a + point(10);
    // Both ends are beyond the edge bc, at twice its distance from a.
    const double v = number(-3, 3), w = number(-3, 3);
    const Vec3d start = in_plane(a, b, c, v, 2 - v), end = in_plane(a, b, c, w, 2 - w);
    const Vec3d center = (start + end) * 0.5, half_axis = (end - start) * 0.5;
    const double height = std::sqrt(squared_length(cross(b - a, c - a)) / squared_length(c - b));
    EXPECT_FALSE(segment_crosses_triangle(center, half_axis, a, b, c)) << i;
    EXPECT_GE(squared_distance_segment_triangle(center, half_axis, a, b, c), height * height * 0.99) << i;
  }
}

TEST_F(SegmentTriangleTest, ASegmentInThePlaneThatMeetsTheTriangleHasDistanceZeroUpToRounding) {
  for (int i = 0; i < 20000; ++i) {
    const Vec3d a = point(1000), b = a + point(10), c = a + point(10);
    const double v = number(0, 0.5), w = number(0, 0.5);
    const Vec3d start = in_plane(a, b, c, v, w), end = in_plane(a, b, c, number(-3, 3), number(-3, 3));
    const double squared = squared_distance_segment_triangle((start + end) * 0.5, (end - start) * 0.5, a, b, c);
    EXPECT_LE(squared, 1e-22) << i;
  }
}

TEST_F(SegmentTriangleTest, ASegmentThatCrossesAtASmallAngleHasDistanceZeroUpToRounding) {
  for (int i = 0; i < 20000; ++i) {
    const Vec3d a = point(1000), b = a + point(10), c = a + point(10);
    const double v = number(0, 0.5), w = number(0, 0.5);
    const Vec3d along = in_plane({}, b - a, c - a, number(-1, 1), number(-1, 1));
    const Vec3d off = normalized(cross(b - a, c - a)) * std::exp2(number(-50, 0));
    const Vec3d center = in_plane(a, b, c, v, w);
    EXPECT_LE(squared_distance_segment_triangle(center, along + off, a, b, c), 1e-22) << i;
  }
}

TEST_F(SegmentTriangleTest, ASegmentThroughTheTriangleCrossesIt) {
  for (int i = 0; i < 20000; ++i) {
    const Vec3d a = point(1000), b = a + point(10), c = a + point(10);
    const double v = number(0.01, 0.49), w = number(0.01, 0.49);
    const Vec3d off = normalized(cross(b - a, c - a)) * number(0.1, 10);
    EXPECT_TRUE(segment_crosses_triangle(in_plane(a, b, c, v, w), off, a, b, c)) << i;
    EXPECT_FALSE(segment_crosses_triangle(in_plane(a, b, c, -v, w) + off * 2, off, a, b, c)) << i;
  }
}

}  // namespace
}  // namespace locus
