#include "core/geometry/triangle_overlap.h"

#include "gtest/gtest.h"
#include "tests/support/box_clip.h"
#include "tests/support/triangle_reference.h"

namespace locus {
namespace {

using test::Random;
using test::random_triangle;
using test::Real;
using test::reference_distance;
using test::size_of;
using test::to_real;

// Returns whether the triangle overlaps the box after the box is grown by `grown` (shrunk if `grown` is negative), by
// polygon clipping in long double.
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

Triangle lattice_triangle(Random& random, int extent) {
  return {to_float(random.whole_vector(extent)), to_float(random.whole_vector(extent)),
          to_float(random.whole_vector(extent)), 0};
}

TEST(TriangleOverlapTest, VerdictsOnLatticeBoxesAreExact) {
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

TEST(TriangleOverlapTest, VerdictsOnLatticeBallsAreExact) {
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

TEST(TriangleOverlapTest, A345TriangleTouchesEdgeFaceAndVertex) {
  const Triangle t{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, 0};
  EXPECT_TRUE(ball_overlaps({{4, -3, 4}, 5}, t));
  EXPECT_FALSE(ball_overlaps({{4, -3, 4}, std::nextafter(5.0f, 0.0f)}, t));
  EXPECT_TRUE(ball_overlaps({{2, 2, 5}, 5}, t));
  EXPECT_FALSE(ball_overlaps({{2, 2, 5}, std::nextafter(5.0f, 0.0f)}, t));
  EXPECT_TRUE(ball_overlaps({{-4, -3, 0}, 5}, t));
  EXPECT_FALSE(ball_overlaps({{-4, -3, 0}, std::nextafter(5.0f, 0.0f)}, t));
}

TEST(TriangleOverlapTest, ABallThatDoesNotReachATriangleDoesNotOverlapIt) {
  const Triangle floor{{-10, -10, -2}, {10, -10, -2}, {0, 10, -2}, 0};
  EXPECT_FALSE(ball_overlaps({{0, 0, 0}, 1}, floor));
}

TEST(TriangleOverlapTest, BallsAndBoxesOfZeroSizeOverlapATriangleThatContainsThem) {
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

// A needle is a triangle whose height is tiny. A test of the needle's interior by dot products can miss an overlap
// because of cancellation; the distances to the needle's three edges are still correct.
TEST(TriangleOverlapTest, NeedlesAreNotDropped) {
  const Triangle needle{{1000, 0, 0}, {1100, 0, 0}, {1050, 1e-5f, 0}, 0};
  EXPECT_TRUE(ball_overlaps({{1025, 0, 0.5f}, 0.5f}, needle));
  EXPECT_TRUE(ball_overlaps({{1075, 1, 0}, 1.0f}, needle));
  EXPECT_FALSE(ball_overlaps({{1025, 0, 0.5f}, 0.499f}, needle));
}

}  // namespace
}  // namespace locus
