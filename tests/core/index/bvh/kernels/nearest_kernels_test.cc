// Compares the nearest kernels of every instruction set with the distances of all triangles in double.
#include "core/index/bvh/kernels/nearest_kernels.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/index/bvh/kernels/dispatch.h"
#include "tests/support/nearest_trials.h"
#include "tests/support/vector_sets.h"

namespace locus::test {
namespace {

class NearestKernelsTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    ASSERT_TRUE(use_instruction_set(GetParam()).ok());
    ASSERT_NE(active_nearest_kernels(), nullptr);
  }
  void TearDown() override { ASSERT_TRUE(use_instruction_set("").ok()); }

  void compare(const std::vector<NearestTrial>& trials) {
    for (const NearestTrial& trial : trials)
      ASSERT_EQ(trial.difference(*active_nearest_kernels(), &candidates_, &searches_), "");
  }

  uint64_t candidates_ = 0, searches_ = 0;
};

TEST_P(NearestKernelsTest, FindAllThatIsNearInOrdinaryMeshes) {
  compare(ordinary_nearest_trials());
  // A search must return fewer than 30 candidates on average. Most candidates are necessary: all triangles around the
  // nearest vertex, and the triangles that are farther than the nearest triangle by at most the search's slack.
  EXPECT_LT(candidates_, 30 * searches_);
}

TEST_P(NearestKernelsTest, FindAllThatIsNearAmongTrianglesOfManySizesAndSlivers) { compare(uneven_nearest_trials()); }

TEST_P(NearestKernelsTest, FindAllThatIsNearInTinyHugeAndFarMeshes) { compare(scaled_nearest_trials()); }

TEST_P(NearestKernelsTest, FindPointsExactlyAtTheLimit) { compare(point_nearest_trials()); }

TEST_P(NearestKernelsTest, FindAllTrianglesThatAreEquallyNear) { compare(tied_nearest_trials()); }

TEST_P(NearestKernelsTest, FewTrianglesAreCandidates) {
  const std::vector<Triangle> sphere = bumpy_sphere(40, 0.1, 1);
  RandomRegions regions(sphere, 5);
  std::vector<NearestTarget> targets;
  for (size_t i = 0; i < scaled_count(200); ++i) targets.push_back({to_double(regions.ball().center)});
  const NearestTrial trial("sphere", sphere, targets);
  ASSERT_EQ(trial.difference(*active_nearest_kernels(), &candidates_, &searches_), "");
  EXPECT_LT(candidates_, 8 * searches_);
}

TEST_P(NearestKernelsTest, ACallPausesAfterTheMaximumNumberOfTests) {
  std::vector<Triangle> pile;
  for (uint32_t i = 0; i < 3 * kMaxNearestTests; ++i) {
    const float x = static_cast<float>(i) * 1e-6f;
    pile.push_back({{x, -1, -1}, {x, 1, -1}, {x, -1, 1}, i});
  }
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(pile);
  ASSERT_TRUE(tree.ok());
  NearestSearch search(*tree, {0, 5, 5}, 100, NearestSearch::Find::kNearest, 50);
  search.next();
  EXPECT_FALSE(search.over());
  EXPECT_LT(search.tests(), kMaxNearestTests + 8);
  uint64_t found = search.found();
  while (!search.over()) {
    search.next();
    EXPECT_LT(search.found(), kMaxCandidates + 8);
    found += search.found();
  }
  EXPECT_EQ(found, pile.size());
}

TEST_P(NearestKernelsTest, TrianglesBeyondALoweredLimitAreNoCandidates) {
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(bumpy_sphere(40, 0.1, 1));
  ASSERT_TRUE(tree.ok());
  NearestSearch search(*tree, {0, 0, 3}, 10, NearestSearch::Find::kEvery);
  search.next();
  uint64_t found = search.found();
  search.lower_limit(0.5);
  while (!search.over()) {
    search.next();
    found += search.found();
  }
  EXPECT_LT(found, 16u);
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(NearestKernelsTest);
INSTANTIATE_TEST_SUITE_P(InstructionSets, NearestKernelsTest, ::testing::ValuesIn(sets_with_vector_kernels()),
                         [](const auto& instance) { return instance.param; });

}  // namespace
}  // namespace locus::test
