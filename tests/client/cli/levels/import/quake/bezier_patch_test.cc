#include "client/cli/levels/import/quake/bezier_patch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "client/cli/levels/generate/splitmix64.h"

namespace locus::cli {
namespace {

PatchPoint random_point(SplitMix64& random) {
  PatchPoint point;
  for (double& coordinate : point) coordinate = static_cast<float>((random.unit() - 0.5) * 4096);
  return point;
}

std::vector<PatchPoint> random_points(size_t count, SplitMix64& random) {
  std::vector<PatchPoint> points;
  while (points.size() < count) points.push_back(random_point(random));
  return points;
}

TEST(BezierPatchTest, CurvePassesThroughItsEndsAndTheKnownMiddle) {
  const PatchPoint a{0, 0, 0}, b{2, 4, 0}, c{4, 0, 8};
  EXPECT_EQ(bezier_curve_point(a, b, c, 0, 6), a);
  EXPECT_EQ(bezier_curve_point(a, b, c, 6, 6), c);
  EXPECT_EQ(bezier_curve_point(a, b, c, 3, 6), (PatchPoint{2, 2, 2}));
}

TEST(BezierPatchTest, ReversedCurvesGiveTheSameBits) {
  constexpr uint64_t kSeed = 3;
  SplitMix64 random(kSeed);
  for (int round = 0; round < 2000; ++round) {
    const PatchPoint a = random_point(random), b = random_point(random), c = random_point(random);
    const int steps = 1 + static_cast<int>(random.below(64));
    for (int step = 0; step <= steps; ++step) {
      ASSERT_EQ(bezier_curve_point(a, b, c, step, steps), bezier_curve_point(c, b, a, steps - step, steps))
          << "seed " << kSeed << " round " << round << " step " << step << " of " << steps;
    }
  }
}

TEST(BezierPatchTest, GridHasTheRequestedSizeAndItsCornersAreControlPoints) {
  constexpr uint64_t kSeed = 4;
  SplitMix64 random(kSeed);
  const std::vector<PatchPoint> controls = random_points(5 * 3, random);
  const PatchGrid grid = tessellate_patch(controls, 5, 3, 6);
  ASSERT_EQ(grid.width, 13u);
  ASSERT_EQ(grid.height, 7u);
  ASSERT_EQ(grid.points.size(), 13u * 7u);
  EXPECT_EQ(grid.points[0], controls[0]);
  EXPECT_EQ(grid.points[6], controls[2]);
  EXPECT_EQ(grid.points[12], controls[4]);
  EXPECT_EQ(grid.points[6 * 13], controls[10]);
  EXPECT_EQ(grid.points.back(), controls.back());
}

TEST(BezierPatchTest, AFlatRegularPatchIsARegularGrid) {
  std::vector<PatchPoint> controls;
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 3; ++x) controls.push_back({x * 4.0, y * 4.0, 5.0});
  }
  const PatchGrid grid = tessellate_patch(controls, 3, 3, 4);
  for (size_t y = 0; y < 5; ++y) {
    for (size_t x = 0; x < 5; ++x) {
      EXPECT_EQ(grid.points[y * 5 + x], (PatchPoint{2.0 * static_cast<double>(x), 2.0 * static_cast<double>(y), 5.0}));
    }
  }
}

// Makes each border of one patch equal to each border of another patch, in both directions; then the tessellated
// borders must be equal too.
TEST(BezierPatchTest, PatchesWithEqualBordersMeetWithoutACrack) {
  constexpr uint64_t kSeed = 5;
  SplitMix64 random(kSeed);
  // Returns the indices of the points on border k, 0 .. 3, of a grid of n x n points: the grid of control points (n =
  // 3) or the tessellated patch.
  const auto border = [](int k, size_t n) {
    std::vector<size_t> at;
    for (size_t i = 0; i < n; ++i) at.push_back(k == 0 ? i : k == 1 ? (n - 1) * n + i : k == 2 ? i * n : i * n + n - 1);
    return at;
  };
  for (int steps : {1, 3, 6, 7, 10}) {
    const auto n = static_cast<size_t>(steps) + 1;
    for (int mine = 0; mine < 4; ++mine) {
      for (int theirs = 0; theirs < 4; ++theirs) {
        for (bool reversed : {false, true}) {
          const std::vector<PatchPoint> first = random_points(9, random);
          std::vector<PatchPoint> second = random_points(9, random);
          for (size_t i = 0; i < 3; ++i) second[border(theirs, 3)[i]] = first[border(mine, 3)[reversed ? 2 - i : i]];
          const PatchGrid one = tessellate_patch(first, 3, 3, steps);
          const PatchGrid other = tessellate_patch(second, 3, 3, steps);
          for (size_t i = 0; i < n; ++i) {
            ASSERT_EQ(other.points[border(theirs, n)[i]], one.points[border(mine, n)[reversed ? n - 1 - i : i]])
                << "seed " << kSeed << " steps " << steps << " borders " << mine << ", " << theirs;
          }
        }
      }
    }
  }
}

TEST(BezierPatchTest, AWideGridEqualsItsPatchesTessellatedSeparately) {
  constexpr uint64_t kSeed = 6;
  SplitMix64 random(kSeed);
  const std::vector<PatchPoint> controls = random_points(5 * 3, random);
  const PatchGrid whole = tessellate_patch(controls, 5, 3, 5);
  for (size_t half = 0; half < 2; ++half) {
    std::vector<PatchPoint> part;
    for (size_t row = 0; row < 3; ++row) {
      for (size_t column = 0; column < 3; ++column) part.push_back(controls[row * 5 + 2 * half + column]);
    }
    const PatchGrid alone = tessellate_patch(part, 3, 3, 5);
    for (size_t y = 0; y < alone.height; ++y) {
      for (size_t x = 0; x < alone.width; ++x) {
        ASSERT_EQ(alone.points[y * alone.width + x], whole.points[y * whole.width + 5 * half + x]) << "seed " << kSeed;
      }
    }
  }
}

}  // namespace
}  // namespace locus::cli
