#include "client/cli/extras/demo/demo_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace locus::cli {
namespace {

constexpr Aabbd kBounds{{-100, 50, 1000}, {300, 90, 1400}};

TEST(DemoWorldTest, ObjectsStayWithinTheBoundsAtEveryTick) {
  const DemoWorld world(kBounds, 50, 3);
  for (const uint64_t tick : {0ull, 1ull, 37ull, 1'000'000ull})
    for (uint32_t i = 0; i < world.size(); ++i) EXPECT_TRUE(contains(kBounds, world.shape(i, tick).position));
}

TEST(DemoWorldTest, ObjectsMoveFromTickToTick) {
  const DemoWorld world(kBounds, 50, 3);
  for (uint32_t i = 0; i < world.size(); ++i) EXPECT_NE(world.shape(i, 4).position, world.shape(i, 5).position);
}

TEST(DemoWorldTest, MovesCarryThePositionsOfTheTick) {
  const DemoWorld world(kBounds, 20, 3);
  const v1::UpdateBatch batch = world.moves(9);
  ASSERT_EQ(batch.moves_size(), 1);
  EXPECT_EQ(batch.tick(), 9u);
  const v1::Move& move = batch.moves(0);
  ASSERT_EQ(move.ids_size(), 20);
  for (int i = 0; i < move.ids_size(); ++i) {
    EXPECT_EQ(move.ids(i), world.id(static_cast<uint32_t>(i)));
    const Vec3d moved =
        world.frame() + Vec3d{move.positions(3 * i), move.positions(3 * i + 1), move.positions(3 * i + 2)};
    EXPECT_EQ(moved, world.shape(static_cast<uint32_t>(i), 9).position);
  }
}

TEST(DemoWorldTest, InsertsHoldEveryObjectOnce) {
  const DemoWorld world(kBounds, 20, 3);
  std::vector<uint64_t> ids;
  const v1::UpdateBatch batch = world.inserts();
  for (const v1::Insert& insert : batch.inserts()) ids.insert(ids.end(), insert.ids().begin(), insert.ids().end());
  std::sort(ids.begin(), ids.end());
  ASSERT_EQ(ids.size(), 20u);
  for (uint32_t i = 0; i < 20; ++i) EXPECT_EQ(ids[i], world.id(i));
}

}  // namespace
}  // namespace locus::cli
