// Tests the displacement bound of a tick and the list of fast movers.
#include "core/scene/objects/tick_moves.h"

#include <gtest/gtest.h>

#include "core/index/hash_grid/hash_grid.h"
#include "core/scene/objects/object_set.h"

namespace locus::test {
namespace {

class TickMovesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::vector<GridItem> items;
    for (uint32_t handle = 0; handle < 200; ++handle) {
      GridItem item;
      item.handle = handle;
      item.entry.id = handle + 1;
      items.push_back(item);
    }
    grid_.apply({{}, {}, items});
    moves_.start_tick(8);
  }
  void move(uint32_t handle, Vec3d to) {
    moves_.moved(grid_.at(handle), to);
    const GridMove move{to, handle};
    grid_.apply({{}, {{&move, 1}}, {}});
  }
  size_t fast_count() {
    const auto& fast = moves_.displacement().fast;
    return fast == nullptr ? 0 : fast->size();
  }

  HashGrid grid_;
  TickMoves moves_;
};

TEST_F(TickMovesTest, ANewTickHasNoDisplacement) {
  EXPECT_EQ(moves_.displacement().bound, 0);
  EXPECT_EQ(fast_count(), 0u);
}

TEST_F(TickMovesTest, TheBoundIsTheLargestDistanceFromTheStartOfTheTick) {
  move(0, {3, 0, 0});
  move(1, {0, 4, 0});
  move(0, {5, 0, 0});
  move(0, {1, 0, 0});
  EXPECT_EQ(moves_.displacement().bound, 5);
}

TEST_F(TickMovesTest, ANewTickMeasuresFromTheLatestPositions) {
  move(0, {5, 0, 0});
  moves_.start_tick(8);
  EXPECT_EQ(moves_.displacement().bound, 0);
  move(0, {6, 0, 0});
  EXPECT_EQ(moves_.displacement().bound, 1);
}

TEST_F(TickMovesTest, AFastMoverIsListedAndDoesNotRaiseTheBound) {
  move(0, {5, 0, 0});
  move(7, {100, 0, 0});
  move(7, {-50, 3, 0});
  EXPECT_EQ(moves_.displacement().bound, 5);
  ASSERT_EQ(fast_count(), 1u);
  const FastMover& mover = moves_.displacement().fast->front();
  EXPECT_EQ(mover.handle, 7u);
  EXPECT_EQ(mover.centers, (Aabbd{{-50, 0, 0}, {100, 3, 0}}));
}

TEST_F(TickMovesTest, AMoveWithinTheBoundExtendsTheBoxOfAFastMover) {
  move(0, {5, 0, 0});
  move(7, {100, 0, 0});
  move(7, {0, 3, 0});
  EXPECT_EQ(moves_.displacement().bound, 5);
  ASSERT_EQ(fast_count(), 1u);
  EXPECT_EQ(moves_.displacement().fast->front().centers, (Aabbd{{0, 0, 0}, {100, 3, 0}}));
}

TEST_F(TickMovesTest, AMoveBeyondTheBoundExtendsTheBoxOfAFastMoverAndDoesNotRaiseTheBound) {
  move(0, {1, 0, 0});
  move(7, {100, 0, 0});
  move(7, {0, 6, 0});
  EXPECT_EQ(moves_.displacement().bound, 1);
  ASSERT_EQ(fast_count(), 1u);
  EXPECT_EQ(moves_.displacement().fast->front().centers, (Aabbd{{0, 0, 0}, {100, 6, 0}}));
}

TEST_F(TickMovesTest, AShortMoveBeforeALongOneRaisesTheBoundAndOneAfterItExtendsTheBox) {
  move(7, {0, 3, 0});
  move(7, {100, 0, 0});
  move(7, {0, -2, 0});
  EXPECT_EQ(moves_.displacement().bound, 3);
  ASSERT_EQ(fast_count(), 1u);
  EXPECT_EQ(moves_.displacement().fast->front().centers, (Aabbd{{0, -2, 0}, {100, 0, 0}}));
}

TEST_F(TickMovesTest, APublishedListKeepsItsBoxes) {
  move(7, {100, 0, 0});
  const Displacement published = moves_.displacement();
  move(7, {0, 3, 0});
  EXPECT_EQ(published.fast->front().centers, (Aabbd{{0, 0, 0}, {100, 0, 0}}));
  EXPECT_EQ(moves_.displacement().fast->front().centers, (Aabbd{{0, 0, 0}, {100, 3, 0}}));
}

TEST_F(TickMovesTest, AFastMoverIsNotListedInTheNextTick) {
  move(7, {100, 0, 0});
  moves_.start_tick(8);
  move(7, {100, 3, 0});
  EXPECT_EQ(moves_.displacement().bound, 3);
  EXPECT_EQ(fast_count(), 0u);
}

TEST_F(TickMovesTest, ANewObjectWithTheHandleOfAFastMoverHasNoDisplacement) {
  move(7, {100, 0, 0});
  moves_.start_tick(8);
  moves_.born(7);
  move(7, {0, 3, 0});
  move(7, {0, 300, 0});
  EXPECT_EQ(moves_.displacement().bound, 0);
  EXPECT_EQ(fast_count(), 0u);
}

TEST_F(TickMovesTest, AnObjectRemovedFromTheListRaisesTheBoundAndMayBeListedAgain) {
  for (uint32_t handle = 0; handle <= TickMoves::kMaxFast; ++handle) move(handle, {10, 0, 0});
  ASSERT_EQ(fast_count(), 0u) << "far means farther than 16 now";
  EXPECT_EQ(moves_.displacement().bound, 10);
  move(3, {0, 12, 0});
  EXPECT_EQ(moves_.displacement().bound, 12);
  EXPECT_EQ(fast_count(), 0u);
  move(3, {20, 0, 0});
  move(3, {0, 0, 2});
  EXPECT_EQ(moves_.displacement().bound, 12);
  ASSERT_EQ(fast_count(), 1u);
  EXPECT_EQ(moves_.displacement().fast->front().centers, (Aabbd{{0, 0, 0}, {20, 0, 2}}));
}

TEST_F(TickMovesTest, ANewObjectHasNoDisplacement) {
  moves_.born(3);
  move(3, {1000, 0, 0});
  EXPECT_EQ(moves_.displacement().bound, 0);
  EXPECT_EQ(fast_count(), 0u);
}

TEST_F(TickMovesTest, IfManyObjectsAreFastOnlyTheFastestAreListed) {
  for (uint32_t handle = 0; handle < 200; ++handle) move(handle, {handle < 190 ? 10.0 + handle : 5000, 0, 0});
  const Displacement& displacement = moves_.displacement();
  ASSERT_NE(displacement.fast, nullptr);
  EXPECT_LE(displacement.fast->size(), TickMoves::kMaxFast);
  EXPECT_GE(displacement.fast->size(), 10u);
  EXPECT_LT(displacement.bound, 5000);
  const size_t rest = std::min<size_t>(190, static_cast<size_t>(displacement.bound) - 9);
  EXPECT_EQ(rest + displacement.fast->size(), 200u);
}

}  // namespace
}  // namespace locus::test
