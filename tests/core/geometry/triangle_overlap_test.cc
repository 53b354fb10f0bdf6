#include "core/geometry/triangle_overlap.h"

#include <cstdint>
#include <tuple>
#include <utility>

#include "gtest/gtest.h"
#include "tests/support/box_clip.h"
#include "tests/support/convex_reference.h"
#include "tests/support/random.h"

namespace locus {
namespace {

using test::Random;
using test::Real;
using test::to_real;
using test::Vec3r;

// General triangles, slivers, segments and points, of any size.
Triangle random_triangle(Random& random) {
  const Vec3d place = random.vector(random.magnitude(0, 10));
  const double size = random.magnitude(-6, 6);
  Triangle t{to_float(place + random.vector(size)), to_float(place + random.vector(size)), {}, 0};
  t.c = to_float(place + random.vector(size));
  if (random.chance(0.3)) {  // a sliver: the third vertex almost on the line of the others
    const Vec3d along = to_double(t.a) + (to_double(t.b) - to_double(t.a)) * random.between(-0.5, 1.5);
    t.c = to_float(along + random.vector(size * random.magnitude(-24, -2)));
  }
  if (random.chance(0.05)) t.c = t.b;
  if (random.chance(0.02)) t.a = t.b = t.c;
  return t;
}

double size_of(const Triangle& t) { return std::sqrt(squared_length(to_double(bounds_of(t)).extent())); }

// Least distance over all weights, by search within search: convex in each.
Real reference_distance(Vec3r point, const Triangle& t) {
  const Vec3r a = to_real(t.a) - point, ab = to_real(t.b) - to_real(t.a), ac = to_real(t.c) - to_real(t.a);
  const auto nearest_v = [&](Real u) {
    const auto distance = [&](Real v) { return test::length(a + ab * u + ac * v); };
    const Real limit = 1 - u;
    return std::min(distance(test::argmin(distance, 0, limit)), std::min(distance(0), distance(limit)));
  };
  return std::min(nearest_v(test::argmin(nearest_v, 0, 1)), std::min(nearest_v(0), nearest_v(1)));
}

TEST(TriangleOverlapTest, DistanceAgreesWithASearchOverAllWeights) {
  constexpr uint64_t kSeed = 41;
  Random random(kSeed);
  for (int i = 0; i < 10000; ++i) {
    const Triangle t = random_triangle(random);
    const double size = size_of(t) + 1e-6;
    const Vec3d point = to_double(t.a) + random.vector(size * random.magnitude(-8, 3));
    const Real expected = reference_distance(to_real(point), t);
    const Real actual = std::sqrt(Real{squared_distance(point, t)});
    const Real tolerance = 1e-9L * (expected + size);
    ASSERT_NEAR(static_cast<double>(actual), static_cast<double>(expected), static_cast<double>(tolerance))
        << "seed " << kSeed << " case " << i;
  }
}

// Vertices of whole numbers whose cross product is 1, and a third beside the origin: as thin as floats allow, with a
// normal of which only a few bits are known.
Triangle hairline(Random& random) {
  constexpr int64_t kLargest = 1 << 21;
  int64_t p = random.whole(1, kLargest), q = random.whole(1, kLargest);
  // Extended Euclid: p * s - q * r = 1 for coprime p and q.
  int64_t r0 = p, r1 = q, s0 = 1, s1 = 0, t0 = 0, t1 = 1;
  while (r1 != 0) {
    const int64_t n = r0 / r1;
    std::tie(r0, r1) = std::pair(r1, r0 - n * r1);
    std::tie(s0, s1) = std::pair(s1, s0 - n * s1);
    std::tie(t0, t1) = std::pair(t1, t0 - n * t1);
  }
  p /= r0, q /= r0;
  const int64_t s = s0, r = -t0;
  const Vec3d b = {double(p), double(q), double(p + q)}, c = {double(r), double(s), double(r + s)};
  return {to_float(random.vector(random.magnitude(-26, 0))), to_float(b), to_float(c), 0};
}

TEST(TriangleOverlapTest, DistanceToHairlinesAgreesWithTheSearch) {
  constexpr uint64_t kSeed = 45;
  Random random(kSeed);
  for (int i = 0; i < 5000; ++i) {
    const Triangle t = hairline(random);
    const Vec3d along = to_double(t.b) * random.between(-0.1, 1.1);
    const Vec3d point = along + random.vector(size_of(t) * random.magnitude(-40, 0));
    const Real expected = reference_distance(to_real(point), t);
    const Real actual = std::sqrt(Real{squared_distance(point, t)});
    ASSERT_NEAR(static_cast<double>(actual), static_cast<double>(expected), 1e-9 * size_of(t))
        << "seed " << kSeed << " case " << i;
  }
}

// A polygon clipped in long double, the box grown or shrunk by a margin.
bool reference_overlap(const Obbf& box, const Quaternion& rotation, const Triangle& t, Real grown) {
  const test::RealBox real = test::real_box(to_real(box.center), rotation, to_real(box.half));
  return test::clipped_polygon_remains({real.local(to_real(t.a)), real.local(to_real(t.b)), real.local(to_real(t.c))},
                                       real.half, grown);
}

TEST(TriangleOverlapTest, RandomBoxesAgreeWithClipping) {
  constexpr uint64_t kSeed = 42;
  Random random(kSeed);
  int found = 0;
  for (int i = 0; i < 50000; ++i) {
    const Triangle t = random_triangle(random);
    const double size = size_of(t) + 1e-3;
    Vec3f half = to_float(random.positive_vector(size * random.magnitude(-6, 1)));
    if (random.chance(0.1)) half[static_cast<int>(random.below(3))] = 0;
    if (random.chance(0.05)) half = {};
    const Quaternion rotation = random.chance(0.6) ? random.rotation() : Quaternion{};
    const Vec3d near = to_double(t.a) + (to_double(t.b) - to_double(t.a)) * random.unit();
    const Obbf box{to_float(near + random.vector(0.7 * size)), half, rotation_of(rotation)};
    const Real tolerance = 1e-10L * (size + test::length(to_real(box.half)));
    const bool verdict = box_overlaps(box, t);
    found += verdict;
    if (!reference_overlap(box, rotation, t, tolerance)) {
      ASSERT_FALSE(verdict) << "seed " << kSeed << " case " << i;
    } else if (reference_overlap(box, rotation, t, -tolerance)) {
      ASSERT_TRUE(verdict) << "seed " << kSeed << " case " << i;
    }
  }
  EXPECT_GT(found, 5000);
}

Triangle lattice_triangle(Random& random, int reach) {
  return {to_float(random.whole_vector(reach)), to_float(random.whole_vector(reach)),
          to_float(random.whole_vector(reach)), 0};
}

TEST(TriangleOverlapTest, LatticeBoxesAreJudgedExactly) {
  constexpr uint64_t kSeed = 43;
  Random random(kSeed);
  int touching = 0;
  for (int i = 0; i < 100000; ++i) {
    const Triangle t = lattice_triangle(random, 4);
    const Obbf box{to_float(random.whole_vector(5)), to_float(abs(random.whole_vector(2))), {}};
    const bool expected = reference_overlap(box, {}, t, 1e-9L);
    touching += expected && !reference_overlap(box, {}, t, -1e-9L);
    ASSERT_EQ(box_overlaps(box, t), expected) << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(touching, 1000);
}

TEST(TriangleOverlapTest, LatticeBallsAreJudgedExactly) {
  constexpr uint64_t kSeed = 44;
  Random random(kSeed);
  int touching = 0;
  for (int i = 0; i < 10000; ++i) {
    const Triangle t = lattice_triangle(random, 4);
    const Ballf ball{to_float(random.whole_vector(6)), float(random.whole(0, 5))};
    const Real gap = reference_distance(to_real(ball.center), t) - ball.radius;
    touching += std::abs(gap) < 1e-7L;
    ASSERT_EQ(ball_overlaps(ball, t), gap < 1e-7L) << "seed " << kSeed << " case " << i;
  }
  EXPECT_GT(touching, 50);
}

TEST(TriangleOverlapTest, ThreeFourFiveTouchesEdgeFaceAndVertex) {
  const Triangle t{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, 0};
  EXPECT_TRUE(ball_overlaps({{4, -3, 4}, 5}, t));
  EXPECT_FALSE(ball_overlaps({{4, -3, 4}, std::nextafter(5.0f, 0.0f)}, t));
  EXPECT_TRUE(ball_overlaps({{2, 2, 5}, 5}, t));
  EXPECT_FALSE(ball_overlaps({{2, 2, 5}, std::nextafter(5.0f, 0.0f)}, t));
  EXPECT_TRUE(ball_overlaps({{-4, -3, 0}, 5}, t));
  EXPECT_FALSE(ball_overlaps({{-4, -3, 0}, std::nextafter(5.0f, 0.0f)}, t));
}

TEST(TriangleOverlapTest, BallInsideAClosedSurfaceThatReachesNothingFindsNothing) {
  const Triangle floor{{-10, -10, -2}, {10, -10, -2}, {0, 10, -2}, 0};
  EXPECT_FALSE(ball_overlaps({{0, 0, 0}, 1}, floor));
}

TEST(TriangleOverlapTest, ZeroRadiusAndZeroExtentTouchWhatContainsThem) {
  const Triangle t{{0, 0, 0}, {8, 0, 4}, {0, 8, 4}, 0};
  EXPECT_TRUE(ball_overlaps({{2, 2, 2}, 0}, t));
  EXPECT_FALSE(ball_overlaps({{2, 2, 2.0000002f}, 0}, t));
  EXPECT_TRUE(box_overlaps({{2, 2, 2}, {0, 0, 0}, {}}, t));
  EXPECT_FALSE(box_overlaps({{2, 2, 2.0000002f}, {0, 0, 0}, {}}, t));
}

TEST(TriangleOverlapTest, TrianglesWithoutAreaCountAsSegmentsAndPoints) {
  const Triangle segment{{0, 0, 0}, {4, 4, 0}, {8, 8, 0}, 0};
  EXPECT_TRUE(box_overlaps({{3, 3, 1}, {0, 0, 1}, {}}, segment));
  EXPECT_FALSE(box_overlaps({{3, 1, 0}, {0.5, 0.5, 1}, {}}, segment));
  EXPECT_TRUE(box_overlaps({{3, 1, 0}, {1, 1, 1}, {}}, segment));
  EXPECT_TRUE(ball_overlaps({{5, 5, 2}, 2}, segment));
  const Triangle point{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, 0};
  EXPECT_TRUE(box_overlaps({{0, 0, 0}, {1, 1, 1}, {}}, point));
  EXPECT_FALSE(box_overlaps({{0, 0, 0}, {1, 1, 0.99f}, {}}, point));
  EXPECT_TRUE(ball_overlaps({{1, 1, -1}, 2}, point));
}

// Region tests on dot products lose needles to cancellation; distances to the three edges do not.
TEST(TriangleOverlapTest, NeedlesAreNotDropped) {
  const Triangle needle{{1000, 0, 0}, {1100, 0, 0}, {1050, 1e-5f, 0}, 0};
  EXPECT_TRUE(ball_overlaps({{1025, 0, 0.5f}, 0.5f}, needle));
  EXPECT_TRUE(ball_overlaps({{1075, 1, 0}, 1.0f}, needle));
  EXPECT_FALSE(ball_overlaps({{1025, 0, 0.5f}, 0.499f}, needle));
}

}  // namespace
}  // namespace locus
