#include "core/query/run/batch_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/query/columns.h"
#include "core/query/run/run_batch.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::IsEmpty;

// A batch and its answer, which a run borrows.
struct Asked {
  Asked(const SceneSnapshot& snapshot, std::vector<OwnedBlock> asked, RunOptions options = {}, uint32_t reply_bytes = 0)
      : blocks(std::move(asked)), batch(batch_of(blocks)) {
    batch.max_reply_bytes = reply_bytes;
    LOCUS_CHECK_EQ(check_batch(batch).ToString(), "OK");
    result.blocks.resize(blocks.size());
    auto prepared = BatchRun::prepare(snapshot, batch, std::move(options), sink);
    LOCUS_CHECK(prepared.ok());
    run = *std::move(prepared);
  }

  const std::vector<OwnedBlock> blocks;
  QueryBatch batch;
  BatchResult result;
  BatchResultSink sink{result};
  std::unique_ptr<BatchRun> run;
};

// Balls around the origin, and a bumpy mesh.
QueryWorld world_of(Id balls) {
  QueryWorld world;
  for (Id id = 1; id <= balls; ++id) world.objects.push_back(ball_object(id, {static_cast<double>(id % 40), 0, 0}));
  world.instances.push_back(placed(1'000'000, mesh_of(bumpy_sphere(6, 0.2, 1)), {10, 0, 0}));
  return world;
}

OwnedBlock many_rays(RayMode mode, size_t count) {
  OwnedBlock block = rays_along_x(mode, {});
  for (size_t i = 0; i < count; ++i) {
    const auto side = static_cast<float>(i % 29) * 0.1f - 1.4f;
    block.points.insert(block.points.end(), {-5, side, static_cast<float>(i % 7) * 0.1f});
  }
  return block;
}

OwnedBlock many_balls(size_t count, StaticDetail detail) {
  OwnedBlock block = one_ball({}, 1, detail);
  block.points.clear();
  for (size_t i = 0; i < count; ++i) block.points.insert(block.points.end(), {static_cast<float>(i % 43), 0, 0});
  return block;
}

// Blocks of every layout, several pieces each.
std::vector<OwnedBlock> mixed_blocks() {
  std::vector<OwnedBlock> blocks = {many_rays(RayMode::kFirst, 700), many_balls(900, StaticDetail::kInstances),
                                    many_rays(RayMode::kAny, 600),   many_rays(RayMode::kFirst, 0),
                                    many_rays(RayMode::kAll, 700),   many_balls(300, StaticDetail::kTriangles),
                                    lookup_of_ids({1, 2, 99'999}),   lookup_of_groups({1}),
                                    one_point({0, 0, 0}, 50)};
  blocks[0].settings.columns = {Column::kT, Column::kId, Column::kUv, Column::kNormal, Column::kPoint};
  blocks[4].settings.columns = {Column::kT, Column::kNormal, Column::kPose};
  return blocks;
}

// Works on `run` with so many threads; the number of calls that were told it is done.
int work_on(BatchRun& run, size_t threads) {
  std::atomic<int> told{0};
  std::vector<std::thread> pool;
  for (size_t i = 0; i < threads; ++i)
    pool.emplace_back([&] {
      Progress progress = Progress::kMore;
      while (progress == Progress::kMore) progress = run.work(0);
      if (progress == Progress::kDone) ++told;
    });
  for (std::thread& thread : pool) thread.join();
  return told;
}

TEST(BatchRunTest, TheAnswerIsTheSameByteForByteHoweverManyThreadsWork) {
  const SnapshotPtr snapshot = snapshot_of(world_of(200));
  const std::vector<OwnedBlock> blocks = mixed_blocks();
  Asked alone(*snapshot, blocks);
  ASSERT_EQ(work_on(*alone.run, 1), 1);
  const auto bytes = static_cast<uint32_t>(fixed_reply_bytes(alone.batch));
  for (const uint32_t reply_bytes : {0u, bytes + 5'000, bytes + 40'000}) {
    Asked expected(*snapshot, blocks, {}, reply_bytes);
    work_on(*expected.run, 1);
    for (const size_t threads : {2, 3, 8}) {
      Asked asked(*snapshot, blocks, {}, reply_bytes);
      EXPECT_EQ(work_on(*asked.run, threads), 1) << "exactly one is told";
      EXPECT_TRUE(asked.run->status().ok());
      EXPECT_EQ(difference(asked.result, expected.result), "") << threads << " threads, " << reply_bytes;
    }
  }
}

TEST(BatchRunTest, ABatchWithoutQueriesIsDoneAtTheFirstCall) {
  const SnapshotPtr snapshot = snapshot_of(world_of(1));
  Asked asked(*snapshot, {many_rays(RayMode::kFirst, 0)});
  EXPECT_EQ(asked.run->work(0), Progress::kDone);
  EXPECT_EQ(asked.run->work(0), Progress::kBegun) << "told once";
}

TEST(BatchRunTest, CheapQueriesGoManyAtOnce) {
  const SnapshotPtr snapshot = snapshot_of(world_of(1));
  const std::vector<OwnedBlock> blocks = {many_balls(256, StaticDetail::kInstances)};
  Asked asked(*snapshot, blocks);
  EXPECT_EQ(asked.run->work(0), Progress::kDone);
}

TEST(BatchRunTest, ExpensiveQueriesGoFewAtOnce) {
  QueryWorld world;
  for (Id id = 1; id <= 5'000; ++id) world.objects.push_back(ball_object(id, {0, 0, 0}));
  const SnapshotPtr snapshot = snapshot_of(world);
  OwnedBlock block = one_ball({}, 1);
  block.points.assign(3 * 256, 0);
  block.settings.max_results = 1;
  const std::vector<OwnedBlock> blocks = {block};
  Asked asked(*snapshot, blocks);
  int turns = 1;
  while (asked.run->work(0) == Progress::kMore) ++turns;
  EXPECT_GE(turns, 256 * 5'000 / 32'768) << "so many tests in one turn at most";
}

TEST(BatchRunTest, WithAClockATurnTakesPiecesUntilTheTimeIsUp) {
  const SnapshotPtr snapshot = snapshot_of(world_of(1));
  const std::vector<OwnedBlock> blocks = {many_balls(2'560, StaticDetail::kInstances)};
  uint64_t now = 0;
  RunOptions options;
  options.clock = [&now] { return now += 10; };
  Asked asked(*snapshot, blocks, options);
  int turns = 1;
  while (asked.run->work(50) == Progress::kMore) ++turns;
  EXPECT_EQ(turns, 3) << "ten pieces that look at the clock once, and twice more a turn at both of its ends";
  EXPECT_EQ(asked.run->cost(0).nanoseconds, 60u + 60 + 30) << "from the second look of a turn to its last";
}

TEST(BatchRunTest, WhoLostItsCoreWorksOnUntilItHasWorkedSoLong) {
  const SnapshotPtr snapshot = snapshot_of(world_of(1));
  const std::vector<OwnedBlock> blocks = {many_balls(2'560, StaticDetail::kInstances)};
  uint64_t now = 0, worked = 0;
  RunOptions options;
  options.clock = [&now] { return now += 1'000; };
  options.work_clock = [&worked] { return worked += 10; };
  Asked asked(*snapshot, blocks, options);
  EXPECT_EQ(asked.run->work(90), Progress::kMore);
  EXPECT_EQ(worked, 110u) << "the beginning, nine pieces, the end";
  EXPECT_EQ(asked.run->cost(0).nanoseconds, 100u);
}

TEST(BatchRunTest, EachBlockIsToldWhatItTook) {
  const SnapshotPtr snapshot = snapshot_of(world_of(1));
  const std::vector<OwnedBlock> blocks = {many_balls(256, StaticDetail::kInstances),
                                          many_balls(512, StaticDetail::kInstances)};
  uint64_t now = 0;
  RunOptions options;
  options.clock = [&now] { return now += 10; };
  Asked asked(*snapshot, blocks, options);
  EXPECT_EQ(asked.run->work(1'000), Progress::kDone);
  EXPECT_EQ(asked.run->cost(0).nanoseconds, 20u) << "a piece, and a look at its end";
  EXPECT_EQ(asked.run->cost(1).nanoseconds, 30u);
  EXPECT_EQ(asked.run->cost().nanoseconds, 50u);
}

TEST(BatchRunTest, RowsThatWaitForAnEarlierPieceAreOfAtMostSixteenPieces) {
  const SnapshotPtr snapshot = snapshot_of(world_of(10));
  const std::vector<OwnedBlock> blocks = {many_balls(256 * 40, StaticDetail::kInstances)};
  std::atomic<std::thread::id> slow;
  std::atomic<bool> slow_waits{false}, let_go{false};
  RunOptions options;
  options.stop = [&] {
    if (std::this_thread::get_id() == slow.load()) {
      slow_waits = true;
      while (!let_go) std::this_thread::yield();
    }
    return absl::OkStatus();
  };
  Asked asked(*snapshot, blocks, options);
  Progress last = Progress::kMore;
  std::thread first([&] {
    slow = std::this_thread::get_id();
    while (last == Progress::kMore) last = asked.run->work(0);
  });
  while (!slow_waits) std::this_thread::yield();
  size_t turns = 1;
  while (asked.run->work(0) == Progress::kMore) ++turns;
  EXPECT_EQ(turns, BatchRun::kMaxChunks - 1);
  let_go = true;
  first.join();
  EXPECT_EQ(last, Progress::kDone) << "who held the others up goes on alone";
  EXPECT_EQ(asked.result.blocks[0].counts.size(), 256u * 40);
}

TEST(BatchRunTest, AStoppedBatchIsDoneWithItsStatusAsSoonAsThoseAtWorkComeBack) {
  const SnapshotPtr snapshot = snapshot_of(world_of(100));
  for (const size_t threads : {1, 4}) {
    std::atomic<int> asked_to_stop{0};
    RunOptions options;
    options.stop = [&] { return ++asked_to_stop < 5 ? absl::OkStatus() : absl::CancelledError("gone"); };
    Asked asked(*snapshot, mixed_blocks(), options);
    EXPECT_EQ(work_on(*asked.run, threads), 1);
    EXPECT_EQ(asked.run->status().code(), absl::StatusCode::kCancelled);
    EXPECT_LE(asked_to_stop, 5 + static_cast<int>(threads)) << "nobody begins anything new";
  }
}

// A ray that meets thousands of triangles takes tens of microseconds, and the kernels take many rays at once.
TEST(BatchRunTest, RaysThroughThousandsOfTrianglesAskForTheStopInBoundedWork) {
  constexpr size_t kWalls = 4'000, kRays = 500;
  std::vector<Triangle> walls;
  for (size_t i = 0; i < kWalls; ++i) walls.push_back(wall_triangle(static_cast<float>(i)));
  QueryWorld world;
  world.instances = {placed(1, mesh_of(walls))};
  const SnapshotPtr snapshot = snapshot_of(world);
  OwnedBlock block = many_rays(RayMode::kAll, kRays);
  block.settings.max_results = 100;
  block.masks = {1};
  const std::vector<OwnedBlock> blocks = {block};
  uint64_t asked_to_stop = 0;
  RunOptions options;
  options.stop = [&] {
    ++asked_to_stop;
    return absl::OkStatus();
  };
  Asked asked(*snapshot, blocks, options);
  work_on(*asked.run, 1);
  EXPECT_GE(asked.run->cost().work.tests, kRays * 100);
  EXPECT_GE(asked_to_stop, asked.run->cost().work.tests / 100'000);
}

TEST(BatchRunTest, ColumnsNobodyAskedForAreNeverTouched) {
  const SnapshotPtr snapshot = snapshot_of(world_of(10));
  std::vector<OwnedBlock> blocks = {many_rays(RayMode::kFirst, 40), many_rays(RayMode::kAll, 40)};
  for (OwnedBlock& block : blocks) block.settings.columns = {Column::kId};
  Asked asked(*snapshot, blocks);
  work_on(*asked.run, 1);
  for (const BlockResult& block : asked.result.blocks) {
    EXPECT_FALSE(block.ids.empty());
    EXPECT_THAT(block.t, IsEmpty());
    EXPECT_THAT(block.triangles, IsEmpty());
    EXPECT_THAT(block.points, IsEmpty());
  }
}

}  // namespace
}  // namespace locus::test
