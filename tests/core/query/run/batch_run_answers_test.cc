#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/query/columns.h"
#include "tests/support/run_batch.h"
#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Returns a world of `count` balls, all centred at the origin, with ids from 1.
QueryWorld crowd(Id count) {
  QueryWorld world;
  for (Id id = 1; id <= count; ++id) world.objects.push_back(ball_object(id, {0, 0, 0}));
  return world;
}

BatchResult run(const SceneSnapshot& snapshot, const QueryBatch& batch, const RunOptions& options = {}) {
  EXPECT_TRUE(check_batch(batch).ok());
  auto result = run_batch(snapshot, batch, options);
  EXPECT_TRUE(result.ok());
  return *std::move(result);
}

TEST(RunBatchTest, ABatchWithoutBlocksHasNoResultBlocks) {
  EXPECT_THAT(run(*snapshot_of(crowd(1)), {}).blocks, IsEmpty());
}

TEST(RunBatchTest, ABlockWithoutQueriesHasAnEmptyResultBlock) {
  const std::vector<OwnedBlock> blocks = {rays_along_x(RayMode::kFirst, {}), rays_along_x(RayMode::kAny),
                                          rays_along_x(RayMode::kAll, {})};
  const BatchResult result = run(*snapshot_of(crowd(1)), batch_of(blocks));
  ASSERT_EQ(result.blocks.size(), 3u);
  EXPECT_EQ(difference(result.blocks[0], BlockResult()), "");
  EXPECT_EQ(result.blocks[1].hits, std::string("\1", 1));
  EXPECT_EQ(difference(result.blocks[2], BlockResult()), "");
}

TEST(RunBatchTest, EachBlockHasItsOwnFrame) {
  QueryWorld world;
  world.objects = {ball_object(1, {1e6, 0, 0}), ball_object(2, {-1e6, 0, 0})};
  std::vector<OwnedBlock> blocks = {one_ball({0, 0, 0}, 2), one_ball({0, 0, 0}, 2)};
  blocks[0].settings.frame = {1e6, 0, 0};
  blocks[1].settings.frame = {-1e6, 0, 0};
  const BatchResult result = run(*snapshot_of(world), batch_of(blocks));
  EXPECT_THAT(result.blocks[0].ids, ElementsAre(1));
  EXPECT_THAT(result.blocks[1].ids, ElementsAre(2));
}

TEST(RunBatchTest, DefaultColumnsDependOnTheKind) {
  QueryWorld world = crowd(1);
  world.instances = {placed(2, wall_mesh())};
  const SnapshotPtr snapshot = snapshot_of(world);
  const BlockResult rays = run_block(*snapshot, rays_along_x(RayMode::kAll, {-5, 0, 0}));
  EXPECT_THAT(rays.t, ElementsAre(4, 5));
  EXPECT_THAT(rays.ids, ElementsAre(1, 2));
  EXPECT_THAT(rays.triangles, ElementsAre(kNoTriangle, 0));
  EXPECT_THAT(rays.normals, IsEmpty());
  const BlockResult instances = run_block(*snapshot, one_ball({}, 1));
  EXPECT_THAT(instances.ids, ElementsAre(1, 2));
  EXPECT_THAT(instances.triangles, IsEmpty());
  const BlockResult triangles = run_block(*snapshot, one_box({}, {1, 1, 1}, StaticDetail::kTriangles));
  EXPECT_THAT(triangles.ids, ElementsAre(1, 2));
  EXPECT_THAT(triangles.triangles, ElementsAre(kNoTriangle, 0));
  const BlockResult nearest = run_block(*snapshot, one_point({-5, 0, 0}, 2));
  EXPECT_THAT(nearest.t, ElementsAre(4, 5));
  EXPECT_THAT(nearest.ids, ElementsAre(1, 2));
  EXPECT_THAT(nearest.triangles, ElementsAre(kNoTriangle, 0));
  EXPECT_THAT(nearest.points, IsEmpty());
}

TEST(RunBatchTest, OnlyRequestedColumnsAreFilled) {
  OwnedBlock block = rays_along_x(RayMode::kAll, {-5, 0, 0});
  block.settings.columns = {Column::kTag};
  QueryWorld world = crowd(1);
  world.objects[0].tag = 77;
  const BlockResult result = run_block(*snapshot_of(world), block);
  BlockResult expected;
  expected.counts = {1};
  expected.tags = {77};
  EXPECT_EQ(difference(result, expected), "");
}

TEST(RunBatchTest, RowsThatDoNotFitTheReplyAreDroppedFromTheEndAndListed) {
  OwnedBlock block = one_ball({}, 1);
  block.points.assign(9, 0);
  const std::vector<OwnedBlock> blocks = {block, block};
  QueryBatch batch = batch_of(blocks);
  batch.max_reply_bytes = static_cast<uint32_t>(fixed_reply_bytes(batch)) + 25 * 8 + 7;
  const BatchResult result = run(*snapshot_of(crowd(10)), batch);
  EXPECT_THAT(result.blocks[0].counts, ElementsAre(10, 10, 5));
  EXPECT_THAT(result.blocks[0].truncated, ElementsAre(2));
  EXPECT_THAT(result.blocks[0].ids.back(), 5);
  EXPECT_THAT(result.blocks[1].counts, ElementsAre(0, 0, 0));
  EXPECT_THAT(result.blocks[1].truncated, ElementsAre(0, 1, 2));
}

TEST(RunBatchTest, QueriesWithoutRowsAreNotTruncatedByAFullReply) {
  OwnedBlock block = one_ball({}, 1);
  block.points = {0, 0, 0, 50, 0, 0, 0, 0, 0};
  QueryBatch batch;
  batch.blocks = {block.view()};
  batch.max_reply_bytes = static_cast<uint32_t>(fixed_reply_bytes(batch)) + 4 * 8;
  const BatchResult result = run(*snapshot_of(crowd(4)), batch);
  EXPECT_THAT(result.blocks[0].counts, ElementsAre(4, 0, 0));
  EXPECT_THAT(result.blocks[0].truncated, ElementsAre(2));
}

TEST(RunBatchTest, AReplyThatIsJustLargeEnoughIsComplete) {
  OwnedBlock block = one_ball({}, 1);
  QueryBatch batch;
  batch.blocks = {block.view()};
  batch.max_reply_bytes = static_cast<uint32_t>(fixed_reply_bytes(batch)) + 10 * 8;
  EXPECT_THAT(run(*snapshot_of(crowd(10)), batch).blocks[0].truncated, IsEmpty());
  --batch.max_reply_bytes;
  EXPECT_THAT(run(*snapshot_of(crowd(10)), batch).blocks[0].truncated, ElementsAre(0));
}

TEST(RunBatchTest, PagingAfterAFullReplyGivesTheRest) {
  OwnedBlock block = one_ball({}, 1);
  std::vector<uint64_t> pages;
  const SnapshotPtr snapshot = snapshot_of(crowd(100));
  for (bool more = true; more;) {
    QueryBatch batch;
    batch.blocks = {block.view()};
    batch.max_reply_bytes = static_cast<uint32_t>(fixed_reply_bytes(batch)) + 17 * 8;
    const BatchResult page = run(*snapshot, batch);
    pages.insert(pages.end(), page.blocks[0].ids.begin(), page.blocks[0].ids.end());
    more = !page.blocks[0].truncated.empty();
    block.settings.after_id = pages.back();
  }
  EXPECT_EQ(pages, run_block(*snapshot, one_ball({}, 1)).ids);
}

TEST(RunBatchTest, AStopEndsTheBatchWithItsStatus) {
  RunOptions options;
  options.stop = [] { return absl::DeadlineExceededError("too late"); };
  const OwnedBlock block = one_ball({}, 1);
  QueryBatch batch;
  batch.blocks = {block.view()};
  const auto result = run_batch(*snapshot_of(crowd(10)), batch, options);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(result.status().message(), "too late");
}

TEST(RunBatchTest, TheStopIsPolledAtLeastEvery4096Tests) {
  const SnapshotPtr snapshot = snapshot_of(crowd(5'000));
  for (const uint32_t mask : {1u, 0u}) {  // with mask 0 all objects are skipped, which must count as work too
    int asked = 0;
    RunOptions options;
    options.stop = [&] {
      ++asked;
      return absl::OkStatus();
    };
    OwnedBlock block = one_ball({}, 1);
    block.points.assign(60, 0);
    block.masks = {mask};
    (void)run_block(*snapshot, block, options);
    EXPECT_GE(asked, 20 * 5'000 / 4096) << mask;
  }
}

TEST(RunBatchTest, AStopInTheMiddleEndsTheBatch) {
  const SnapshotPtr snapshot = snapshot_of(crowd(5'000));
  int asked = 0;
  RunOptions options;
  options.stop = [&] { return ++asked < 5 ? absl::OkStatus() : absl::CancelledError("gone"); };
  OwnedBlock block = one_ball({}, 1);
  block.points.assign(3 * 100, 0);
  const OwnedBlock lookup = lookup_of_ids({1});
  QueryBatch batch;
  batch.blocks = {block.view(), lookup.view()};
  EXPECT_EQ(run_batch(*snapshot, batch, options).status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(asked, 5) << "the stop is not polled again after the batch has ended";
}

TEST(RunBatchTest, QueriesNotAnsweredWithinMaxWorkAreListed) {
  const SnapshotPtr snapshot = snapshot_of(crowd(5'000));
  OwnedBlock block = one_ball({}, 1);
  block.points.assign(3 * 20, 0);
  QueryBatch batch;
  batch.blocks = {block.view()};
  batch.max_work = 20'000;
  const BatchResult result = run(*snapshot, batch);
  const BlockResult& cut = result.blocks[0];
  EXPECT_EQ(cut.counts.size(), 20u);
  ASSERT_FALSE(cut.truncated.empty());
  EXPECT_EQ(cut.truncated.back(), 19u);
  EXPECT_LT(cut.work.tests, 40'000u);
  EXPECT_EQ(cut.counts[19], 0u);
}

TEST(RunBatchTest, MaxWorkEndsBatchesOfManySmallQueriesToo) {
  const SnapshotPtr snapshot = snapshot_of(crowd(4));
  const OwnedBlock block = rays_along_x(RayMode::kFirst, std::vector<float>(3 * 60'000, 0));
  QueryBatch batch;
  batch.blocks = {block.view()};
  batch.max_work = 10'000;
  const BatchResult result = run(*snapshot, batch);
  EXPECT_EQ(result.blocks[0].t.size(), 60'000u);
  EXPECT_LT(result.work.tests, 30'000u);
  ASSERT_FALSE(result.blocks[0].truncated.empty());
  const uint32_t first = result.blocks[0].truncated.front();
  EXPECT_EQ(result.blocks[0].t[first - 1], 0) << "completed queries are reported";
  EXPECT_EQ(result.blocks[0].t.back(), std::numeric_limits<float>::infinity()) << "an unanswered query reports a miss";
  EXPECT_EQ(result.blocks[0].truncated.size(), 60'000u - first) << "each unanswered query is listed once";
}

TEST(RunBatchTest, LookupsOfAnEndedBatchAreStillAnswered) {
  const SnapshotPtr snapshot = snapshot_of(crowd(5'000));
  const std::vector<OwnedBlock> blocks = {one_ball({}, 1e6f), lookup_of_ids({1, 2, 3})};
  QueryBatch batch = batch_of(blocks);
  batch.max_work = 1;
  const BatchResult result = run(*snapshot, batch);
  ASSERT_FALSE(result.blocks[0].truncated.empty()) << "the batch has ended";
  EXPECT_EQ(result.blocks[1].ids, (std::vector<uint64_t>{1, 2, 3}));
}

TEST(RunBatchTest, BruteForceCountsATestOfEachValueAndEndsAtMaxWork) {
  const SnapshotPtr snapshot = snapshot_of(crowd(5'000));
  const std::vector<OwnedBlock> blocks = {rays_along_x(RayMode::kFirst, std::vector<float>(3 * 4, 0)),
                                          one_ball({1e6, 0, 0}, 1), lookup_of_ids({1, 5'001}), lookup_of_groups({9})};
  RunOptions brute_force;
  brute_force.brute_force = true;
  QueryBatch batch = batch_of(blocks);
  const BatchResult whole = run(*snapshot, batch, brute_force);
  EXPECT_EQ(difference(whole, run(*snapshot, batch)), "");
  EXPECT_GE(whole.blocks[0].work.tests, 4 * 5'000u);
  for (const size_t block : {1u, 2u, 3u}) EXPECT_GE(whole.blocks[block].work.tests, 5'000u) << block;
  batch.max_work = 10'000;
  const BatchResult cut = run(*snapshot, batch, brute_force);
  EXPECT_LT(cut.work.tests, 20'000u);
  for (const BlockResult& block : cut.blocks) EXPECT_FALSE(block.truncated.empty());
}

TEST(RunBatchTest, EnoughMaxWorkTruncatesNothing) {
  const SnapshotPtr snapshot = snapshot_of(crowd(4));
  const OwnedBlock block = rays_along_x(RayMode::kFirst, std::vector<float>(3 * 1'000, 0));
  QueryBatch batch;
  batch.blocks = {block.view()};
  const BatchResult whole = run(*snapshot, batch);
  batch.max_work = 1'000'000'000;
  EXPECT_EQ(difference(run(*snapshot, batch), whole), "");
}

TEST(RunBatchTest, WorkOfABatchIsTheSumOfItsBlocks) {
  const std::vector<OwnedBlock> blocks = {one_ball({}, 1), rays_along_x(RayMode::kAll), lookup_of_groups({1})};
  QueryWorld world = crowd(30);
  for (Object& object : world.objects) object.group = 1;
  world.instances = {placed(100, wall_mesh())};
  const BatchResult result = run(*snapshot_of(world), batch_of(blocks));
  Work sum;
  for (const BlockResult& block : result.blocks) {
    sum += block.work;
    EXPECT_GE(block.work.tests, 30u);
  }
  EXPECT_EQ(result.work.tests, sum.tests);
  EXPECT_EQ(result.work.nodes, sum.nodes);
  EXPECT_EQ(result.work.cells, sum.cells);
}

// In a grid of at least 250,000 values, a RegionWalk visits many regions together. The walk calls a visitor after
// walk_regions() has returned: if the visitor referenced local variables of walk_regions(), AddressSanitizer would
// detect it.
TEST(RunBatchTest, ManyBallsAndBoxesInAGridLargerThanTheCachesAnswerLikeBruteForce) {
  QueryWorld world;
  for (Id id = 1; id <= 250'000; ++id)
    world.objects.push_back(
        ball_object(id, {static_cast<double>(id % 500), static_cast<double>(id / 500), static_cast<double>(id % 3)}));
  const SnapshotPtr snapshot = snapshot_of(world);
  OwnedBlock balls = one_ball({0, 0, 0}, 2), boxes = one_box({0, 0, 0}, {2, 2, 2});
  for (OwnedBlock* block : {&balls, &boxes}) {
    block->points.clear();
    for (int i = 0; i < 32; ++i)
      block->points.insert(block->points.end(), {static_cast<float>(15 * i), static_cast<float>(14 * i), 0});
  }
  RunOptions brute_force;
  brute_force.brute_force = true;
  for (const OwnedBlock& block : {balls, boxes}) {
    const std::vector<OwnedBlock> blocks = {block};
    const BatchResult walked = run(*snapshot, batch_of(blocks)), listed = run(*snapshot, batch_of(blocks), brute_force);
    EXPECT_EQ(difference(walked.blocks[0], listed.blocks[0]), "");
    EXPECT_GT(walked.blocks[0].ids.size(), 32u);
  }
}

}  // namespace
}  // namespace locus::test
