// The work of small queries grows slowly with the number of values, and is a small part of the work of a list. Work is
// counted, not timed.
#include "tests/support/structure_work.h"

#include <gtest/gtest.h>

#include "tests/support/index_structures.h"

namespace locus::test {
namespace {

// Structures whose work for a small query may grow by at most the power 0.20 of the number of values. Trees with
// CutValues::kAtNode and the list are not among them.
using FastStructures =
    Joined<StructureList<BvhStructure<Object>, GridStructure>, KdTreesInLeavesOf<Object>,
           StructureList<OctreeStructure<Object, 7, CutValues::kInLeaves>,
                         BspTreeStructure<Object, BspPlanes::kBest, CutValues::kInLeaves>,
                         FiniteGridStructure<Object, GridOrder::kXMajor>,
                         FiniteGridStructure<Object, GridOrder::kMorton>, SphereTreeStructure<Object>>>;

template <class Structure>
class StructureWorkTest : public ::testing::Test {};
TYPED_TEST_SUITE(StructureWorkTest, TypesOf<FastStructures>);

TYPED_TEST(StructureWorkTest, SmallQueriesGrowByAtMostThePower020) {
  const WorkGrowth growth = work_growth(TypeParam::make);
  EXPECT_LE(growth.ball_exponent(), 0.20) << growth.few.ball << " to " << growth.many.ball;
  EXPECT_LE(growth.ray_exponent(), 0.20) << growth.few.ray << " to " << growth.many.ray;
  EXPECT_LE(growth.many.ball, 64'000 / 50);
  EXPECT_LE(growth.many.ray, 64'000 / 50);
}

// The reason why IN_LEAVES is the default.
TEST(StructureWorkOfCutValuesTest, AtNodeGrowsMuchFasterThanInLeaves) {
  const WorkGrowth at_node = work_growth(KdTreeAtNode<Object, KdSplit::kMedian>::make);
  const WorkGrowth in_leaves = work_growth(KdTreeInLeaves<Object, KdSplit::kMedian>::make);
  EXPECT_GT(at_node.ball_exponent(), 2 * in_leaves.ball_exponent());
  EXPECT_GT(at_node.many.ball, 4 * in_leaves.many.ball);
}

}  // namespace
}  // namespace locus::test
