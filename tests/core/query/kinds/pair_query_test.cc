// Pairs among balls of radius 1 on a line, three units apart.
#include "core/query/kinds/pair_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"
#include "tests/support/run_batch.h"
#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

QueryWorld four_balls() {
  QueryWorld world;
  for (Id id = 1; id <= 4; ++id) world.objects.push_back(ball_object(id, {3.0 * static_cast<double>(id), 0, 0}));
  return world;
}

OwnedBlock pairs_within(float distance, uint32_t count = 0) {
  OwnedBlock block;
  PairColumns pairs;
  pairs.max_distance = distance;
  pairs.count = count;
  block.settings.kind = pairs;
  return block;
}

TEST(PairQueryTest, EachPairIsOneRowWithTheLowerIdFirst) {
  const BlockResult result = run_block(*snapshot_of(four_balls()), pairs_within(1));
  EXPECT_THAT(result.counts, ElementsAre(3u));
  EXPECT_THAT(result.ids, ElementsAre(1u, 2u, 3u));
  EXPECT_THAT(result.others, ElementsAre(2u, 3u, 4u));
}

TEST(PairQueryTest, AtDistanceZeroSolidsTouch) {
  QueryWorld world = four_balls();
  EXPECT_THAT(run_block(*snapshot_of(world), pairs_within(0)).counts, ElementsAre(0u));
  world.objects[1].shape.position.x = 5;
  EXPECT_THAT(run_block(*snapshot_of(world), pairs_within(0)).ids, ElementsAre(1u));
}

TEST(PairQueryTest, MembersOfAGroupAreNoPair) {
  QueryWorld world = four_balls();
  for (Object& object : world.objects) object.group = object.id <= 2 ? 5 : 0;
  EXPECT_THAT(run_block(*snapshot_of(world), pairs_within(1)).ids, ElementsAre(2u, 3u));
}

TEST(PairQueryTest, MasksFitEitherWayRound) {
  QueryWorld world = four_balls();
  for (Object& object : world.objects) object.layers = object.id == 2 ? 2 : 1;
  OwnedBlock block = pairs_within(1);
  std::get<PairColumns>(block.settings.kind).first_mask = 2;
  std::get<PairColumns>(block.settings.kind).second_mask = 1;
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_THAT(result.ids, ElementsAre(1u, 2u));
  EXPECT_THAT(result.others, ElementsAre(2u, 3u));
  std::get<PairColumns>(block.settings.kind).count = 5;
  const BlockResult nearest = run_block(*snapshot_of(world), block);
  EXPECT_THAT(nearest.ids, ElementsAre(2u, 2u));
  EXPECT_THAT(nearest.others, ElementsAre(1u, 3u));
}

TEST(PairQueryTest, TheNearestOfEachAscendByDistance) {
  const BlockResult result =
      run_block(*snapshot_of(four_balls()), pairs_within(std::numeric_limits<float>::infinity(), 2));
  EXPECT_THAT(result.ids, ElementsAre(1u, 1u, 2u, 2u, 3u, 3u, 4u, 4u));
  EXPECT_THAT(result.others, ElementsAre(2u, 3u, 1u, 3u, 2u, 4u, 3u, 2u));
  EXPECT_THAT(result.t, ElementsAre(1, 4, 1, 1, 1, 1, 1, 4));
}

TEST(PairQueryTest, AnAnswerContinuesBehindAPair) {
  const SnapshotPtr snapshot = snapshot_of(four_balls());
  OwnedBlock block = pairs_within(4);
  block.settings.max_results = 2;
  BlockResult result = run_block(*snapshot, block);
  EXPECT_THAT(result.ids, ElementsAre(1u, 1u));
  EXPECT_THAT(result.truncated, ElementsAre(0u));
  block.settings.after_id = 1;
  std::get<PairColumns>(block.settings.kind).after_other = 2;
  result = run_block(*snapshot, block);
  EXPECT_THAT(result.ids, ElementsAre(1u, 2u));
  EXPECT_THAT(result.others, ElementsAre(3u, 3u));
  std::get<PairColumns>(block.settings.kind).after_other = 0;
  result = run_block(*snapshot, block);
  EXPECT_THAT(result.ids, ElementsAre(2u, 2u));
  EXPECT_THAT(result.truncated, ElementsAre(0u));
}

TEST(PairQueryTest, InstancesAreNotSearched) {
  QueryWorld world;
  world.instances = {placed(1, wall_mesh()), placed(2, wall_mesh())};
  EXPECT_THAT(run_block(*snapshot_of(world), pairs_within(10)).ids, IsEmpty());
}

// Rows of balls along the x axis. The distance of neighbours is exactly the maximum distance of the query, and floats
// cannot represent the positions exactly.
TEST(PairQueryTest, PairsExactlyAtTheDistanceAreFound) {
  Random random(31);
  QueryWorld world;
  const auto fine = [&random](double size) { return std::round(random.between(-size, size) * 0x1p30) * 0x1p-30; };
  for (Id row = 0; row < 50; ++row) {
    const Vec3d start = {fine(300), fine(300), fine(300)};
    for (Id i = 0; i < 20; ++i)
      world.objects.push_back(ball_object(row * 20 + i + 1, start + Vec3d{7.0 * static_cast<double>(i), 0, 0}));
  }
  const OwnedBlock block = pairs_within(5);
  RunOptions list;
  list.brute_force = true;
  const SnapshotPtr snapshot = snapshot_of(world);
  QueryBatch batch;
  batch.blocks.push_back(block.settings);
  const absl::StatusOr<BatchResult> found = run_batch(*snapshot, batch, {}), all = run_batch(*snapshot, batch, list);
  ASSERT_TRUE(found.ok() && all.ok());
  EXPECT_GE(found->blocks[0].ids.size(), 50u * 19);
  EXPECT_EQ(found->blocks[0].ids, all->blocks[0].ids);
  EXPECT_EQ(found->blocks[0].others, all->blocks[0].others);
}

}  // namespace
}  // namespace locus::test
