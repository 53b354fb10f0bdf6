// Compares the crossing kernels of every instruction set with the crossings of all triangles in the list.
#include "core/index/bvh/kernels/crossing_kernels.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/index/bvh/kernels/dispatch.h"
#include "tests/support/crossing_trials.h"

namespace locus::test {
namespace {

class CrossingKernelsTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    ASSERT_TRUE(use_instruction_set(GetParam()).ok());
    ASSERT_NE(active_crossing_kernels(), nullptr);
  }
  void TearDown() override { ASSERT_TRUE(use_instruction_set("").ok()); }

  void compare(const std::vector<CrossingTrial>& trials) {
    for (const CrossingTrial& trial : trials) ASSERT_EQ(trial.difference(*active_crossing_kernels(), &cost_), "");
  }

  CrossingCost cost_;
};

TEST_P(CrossingKernelsTest, SumTheCrossingsOfOrdinaryMeshes) { compare(ordinary_crossing_trials()); }

TEST_P(CrossingKernelsTest, SumTheCrossingsOfTinyHugeAndFarMeshes) { compare(scaled_crossing_trials()); }

TEST_P(CrossingKernelsTest, SumTheCrossingsOfPointsBetweenTwoFloats) { compare(stepped_crossing_trials()); }

TEST_P(CrossingKernelsTest, FewTrianglesAreJudgedInDouble) {
  const std::vector<Triangle> sphere = bumpy_sphere(40, 0.1, 1);
  RandomRegions regions(sphere, 5);
  std::vector<Vec3d> points;
  for (size_t i = 0; i < scaled_count(200); ++i) points.push_back(to_double(regions.ball().center));
  const CrossingTrial trial("sphere", sphere, points);
  ASSERT_EQ(trial.difference(*active_crossing_kernels(), &cost_), "");
  EXPECT_GT(cost_.tests, cost_.searches);
  EXPECT_LT(cost_.exact_tests, cost_.searches);
}

TEST_P(CrossingKernelsTest, ACallPausesAfterTheMaximumAmountOfWork) {
  std::vector<Triangle> pile;
  for (uint32_t i = 0; i < 3 * kMaxCrossingWork; ++i) {
    const float x = 1 + static_cast<float>(i) * 1e-6f;
    pile.push_back({{x, -1, -1}, {x, 1, -1}, {x, -1, 1}, i});
  }
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(pile);
  ASSERT_TRUE(tree.ok());
  WindingSearch search(*tree, {0, -0.5, -0.5}, WindingWay::out({}));
  search.next();
  EXPECT_FALSE(search.over());
  uint64_t tests = search.tests();
  EXPECT_LT(tests, kMaxCrossingWork + kMaxLineBlocks * kTreeWidth);
  while (!search.over()) {
    search.next();
    tests += search.tests();
  }
  EXPECT_EQ(tests, pile.size());
  EXPECT_EQ(std::abs(search.winding()), static_cast<int64_t>(pile.size()));
}

std::vector<std::string> with_kernels() {
  std::vector<std::string> names = instruction_sets();
  names.pop_back();
  return names;
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CrossingKernelsTest);
INSTANTIATE_TEST_SUITE_P(InstructionSets, CrossingKernelsTest, ::testing::ValuesIn(with_kernels()),
                         [](const auto& instance) { return instance.param; });

}  // namespace
}  // namespace locus::test
