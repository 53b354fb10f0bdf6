#include "core/query/kinds/lookup_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

QueryWorld small_world() {
  QueryWorld world;
  world.objects = {ball_object(5, {1e8 + 0.1, 2, 3}), ball_object(2, {4, 5, 6})};
  world.instances = {placed(3, wall_mesh(), {7, 8, 1e-9})};
  world.objects[0].group = world.instances[0].group = 40;
  world.objects[0].tag = 0xFFFFFFFFFFFFFFFFu;
  world.objects[1].layers = 0;
  world.objects[1].shape.rotation = {0, 0, 1, 0};
  return world;
}

TEST(LookupQueryTest, EachIdGivesOneRowInRequestOrder) {
  OwnedBlock block = lookup_of_ids({3, 99, 5, 3});
  block.settings.columns = {Column::kId, Column::kGroup, Column::kTag, Column::kLayers};
  const BlockResult result = run_block(*snapshot_of(small_world()), block);
  EXPECT_THAT(result.counts, IsEmpty());
  EXPECT_THAT(result.ids, ElementsAre(3, 0, 5, 3));
  EXPECT_THAT(result.groups, ElementsAre(40, 0, 40, 40));
  EXPECT_THAT(result.tags, ElementsAre(0, 0, 0xFFFFFFFFFFFFFFFFu, 0));
  EXPECT_THAT(result.layers, ElementsAre(1, 0, 1, 1));
}

TEST(LookupQueryTest, DefaultColumnsAreIdAndPose) {
  const BlockResult result = run_block(*snapshot_of(small_world()), lookup_of_ids({5, 1}));
  EXPECT_THAT(result.ids, ElementsAre(5, 0));
  EXPECT_THAT(result.positions, ElementsAre(1e8 + 0.1, 2, 3, 0, 0, 0));
  EXPECT_THAT(result.rotations, ElementsAre(0, 0, 0, 1, 0, 0, 0, 0));
  EXPECT_THAT(result.groups, IsEmpty());
}

TEST(LookupQueryTest, PosesAreAbsoluteDoublesForAnyFrame) {
  OwnedBlock block = lookup_of_ids({5, 3});
  block.settings.frame = {1e8, 0, 0};
  EXPECT_THAT(run_block(*snapshot_of(small_world()), block).positions, ElementsAre(1e8 + 0.1, 2, 3, 7, 8, 1e-9));
}

TEST(LookupQueryTest, HiddenObjectsAreFoundAndFiltersAreIgnored) {
  OwnedBlock block = lookup_of_ids({2});
  block.masks = {1};
  block.ignore_ids = {2};
  block.settings.source = Source::kStatic;
  const BlockResult result = run_block(*snapshot_of(small_world()), block);
  EXPECT_THAT(result.ids, ElementsAre(2));
  EXPECT_THAT(result.rotations, ElementsAre(0, 0, 1, 0));
}

TEST(LookupQueryTest, GroupsGiveAllTheirMembersAscendingById) {
  const BlockResult result = run_block(*snapshot_of(small_world()), lookup_of_groups({41, 40}));
  EXPECT_THAT(result.counts, ElementsAre(0, 2));
  EXPECT_THAT(result.ids, ElementsAre(3, 5));
}

TEST(LookupQueryTest, HiddenMembersOfAGroupAreFound) {
  QueryWorld world = small_world();
  for (Object& object : world.objects) object.group = 40;
  world.instances[0].layers = 0;
  EXPECT_THAT(run_block(*snapshot_of(world), lookup_of_groups({40})).ids, ElementsAre(2, 3, 5));
}

TEST(LookupQueryTest, AGroupRequestedTwiceIsAnsweredTwice) {
  const BlockResult result = run_block(*snapshot_of(small_world()), lookup_of_groups({40, 40}));
  EXPECT_THAT(result.counts, ElementsAre(2, 2));
  EXPECT_THAT(result.ids, ElementsAre(3, 5, 3, 5));
}

TEST(LookupQueryTest, SmallAndLargeGroupsAmongManyObjectsAreFound) {
  QueryWorld world;
  std::vector<Id> large;
  for (Id id = 1; id <= 2000; ++id) {
    world.objects.push_back(ball_object(id, {}));
    world.objects.back().group = id % 500 == 0 ? 7 : id % 2 == 0 ? 8 : 0;
    if (world.objects.back().group == 8) large.push_back(id);
  }
  const SnapshotPtr snapshot = snapshot_of(world);
  EXPECT_THAT(run_block(*snapshot, lookup_of_groups({7})).ids, ElementsAre(500, 1000, 1500, 2000));
  OwnedBlock block = lookup_of_groups({8});
  block.settings.max_results = limits::kMaxMaxResults;
  EXPECT_EQ(run_block(*snapshot, block).ids, large);
  EXPECT_THAT(run_block(*snapshot, lookup_of_groups({9})).ids, IsEmpty());
}

// If each query stored a separate answer, the batch would need 65,536 * 2,000 rows.
TEST(LookupQueryTest, ALargeGroupRequestedManyTimesIsKeptOnceAndTruncatedToTheReply) {
  QueryWorld world;
  for (Id id = 1; id <= 2000; ++id) world.objects.push_back(ball_object(id, {}));
  for (Object& object : world.objects) object.group = 40;
  OwnedBlock block = lookup_of_groups(std::vector<uint64_t>(65536, 40));
  block.settings.columns = {Column::kId};
  block.settings.max_results = limits::kMaxMaxResults;
  const BlockResult result = run_block(*snapshot_of(world), block);
  EXPECT_LE(result.ids.size() * 8, size_t{limits::kDefaultReplyBytes});
  EXPECT_EQ(result.counts.size(), 65536u);
  EXPECT_EQ(result.counts[0], 2000u);
  EXPECT_EQ(result.truncated.back(), 65535u);
}

TEST(LookupQueryTest, GroupsArePagedByAfterIdAndTruncatedByMaxResults) {
  QueryWorld world;
  for (Id id = 1; id <= 10; ++id) world.objects.push_back(ball_object(id, {}));
  for (Object& object : world.objects) object.group = 40;
  OwnedBlock block = lookup_of_groups({40});
  block.settings.max_results = 4;
  const SnapshotPtr snapshot = snapshot_of(world);
  const BlockResult first = run_block(*snapshot, block);
  EXPECT_THAT(first.ids, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(first.truncated, ElementsAre(0));
  block.settings.after_id = 6;
  const BlockResult last = run_block(*snapshot, block);
  EXPECT_THAT(last.ids, ElementsAre(7, 8, 9, 10));
  EXPECT_THAT(last.truncated, IsEmpty());
}

}  // namespace
}  // namespace locus::test
