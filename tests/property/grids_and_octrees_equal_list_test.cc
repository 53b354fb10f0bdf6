// Finite grids and octrees give the same results as the list, bit for bit, for all of their options. The suites named
// Long... run more scenes.
#include <gtest/gtest.h>

#include "tests/support/finite_grid_comparison.h"
#include "tests/support/octree_comparison.h"

namespace locus::test {
namespace {

TEST(GridsAndOctreesEqualListTest, Grids) {
  EXPECT_EQ(search_all_finite_grids(scaled_count(200), scaled_count(200)), "");
}

TEST(GridsAndOctreesEqualListTest, Octrees) { EXPECT_EQ(search_octrees(scaled_count(100), scaled_count(100)), ""); }

TEST(LongGridsAndOctreesEqualListTest, Grids) {
  EXPECT_EQ(search_all_finite_grids(scaled_count(10'000), scaled_count(1'200)), "");
}

TEST(LongGridsAndOctreesEqualListTest, GridsOfTrees) {
  EXPECT_EQ(search_finite_grids<GridOfTrees<Triangle>>(scaled_count(1'000), scaled_count(1'200)), "");
  EXPECT_EQ(search_finite_grids<GridOfTrees<Object>>(scaled_count(1'000), scaled_count(1'200)), "");
}

TEST(LongGridsAndOctreesEqualListTest, Octrees) {
  EXPECT_EQ(search_octrees(scaled_count(10'000), scaled_count(1'200)), "");
}

}  // namespace
}  // namespace locus::test
