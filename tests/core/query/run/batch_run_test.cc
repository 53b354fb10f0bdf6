#include "core/query/run/batch_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/query/columns.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/run_batch.h"
#include "tests/support/small_world.h"

namespace locus::test {
namespace {

using ::testing::IsEmpty;

// Batch of the requested blocks, its result, and the BatchRun that answers the batch.
struct Prepared {
  Prepared(const SceneSnapshot& snapshot, std::vector<OwnedBlock> requested, RunOptions options = {},
           uint32_t reply_bytes = 0)
      : blocks(std::move(requested)), batch(batch_of(blocks)) {
    batch.max_reply_bytes = reply_bytes;
    LOCUS_CHECK_EQ(check_batch(batch).ToString(), "OK");
    result.blocks.resize(blocks.size());
    auto created = BatchRun::prepare(snapshot, batch, std::move(options), sink);
    LOCUS_CHECK(created.ok());
    run = *std::move(created);
  }

  const std::vector<OwnedBlock> blocks;
  QueryBatch batch;
  BatchResult result;
  BatchResultSink sink{result};
  std::unique_ptr<BatchRun> run;
};

// Returns a world of balls along the x axis and a bumpy mesh.
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

// Returns blocks of several query kinds and column sets, most of them several chunks long.
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

// Calls run.work() on each of `threads` threads until there is no more work. Returns the number of calls that returned
// kDone.
int work_on(BatchRun& run, size_t threads) {
  std::atomic<int> done_calls{0};
  std::vector<std::thread> pool;
  for (size_t i = 0; i < threads; ++i)
    pool.emplace_back([&] {
      Progress progress = Progress::kMore;
      while (progress == Progress::kMore) progress = run.work(0);
      if (progress == Progress::kDone) ++done_calls;
    });
  for (std::thread& thread : pool) thread.join();
  return done_calls;
}

TEST(BatchRunTest, TheResultIsByteIdenticalForAnyNumberOfThreads) {
  const SnapshotPtr snapshot = snapshot_of(world_of(200));
  const std::vector<OwnedBlock> blocks = mixed_blocks();
  Prepared alone(*snapshot, blocks);
  ASSERT_EQ(work_on(*alone.run, 1), 1);
  const auto bytes = static_cast<uint32_t>(fixed_reply_bytes(alone.batch));
  for (const uint32_t reply_bytes : {0u, bytes + 5'000, bytes + 40'000}) {
    Prepared expected(*snapshot, blocks, {}, reply_bytes);
    work_on(*expected.run, 1);
    for (const size_t threads : {2, 3, 8}) {
      Prepared prepared(*snapshot, blocks, {}, reply_bytes);
      EXPECT_EQ(work_on(*prepared.run, threads), 1) << "kDone is returned to exactly one thread";
      EXPECT_TRUE(prepared.run->status().ok());
      EXPECT_EQ(difference(prepared.result, expected.result), "") << threads << " threads, " << reply_bytes;
    }
  }
}

// A sensor's largest sweep: each call works on a small part of the batch, so that other batches run in between, and the
// parts together equal the answers of batches of few rays with directions that were rotated before.
TEST(BatchRunTest, TheLargestBlockOfRaysFromOneOriginIsDividedIntoParts) {
  const SnapshotPtr snapshot = snapshot_of(world_of(100));
  OwnedBlock sweep = rays_along_x(RayMode::kFirst, {-5, 0, 0});
  sweep.settings.columns = {Column::kT};
  const Quaternion half_turn{0, 1, 0, 0};
  sweep.rotation = {half_turn.x, half_turn.y, half_turn.z, half_turn.w};
  sweep.sizes.clear();
  OwnedBlock rotated = sweep;
  rotated.rotation.clear();
  for (uint32_t i = 0; i < limits::kMaxRays; ++i) {
    const Vec3f direction{-1, static_cast<float>(i % 512) / 1024 - 0.25f, static_cast<float>(i / 512) / 1024 - 0.25f};
    const Vec3f turned = to_float(rotation_of(half_turn).to_world(to_double(direction)));
    sweep.sizes.insert(sweep.sizes.end(), {direction.x, direction.y, direction.z});
    rotated.sizes.insert(rotated.sizes.end(), {turned.x, turned.y, turned.z});
  }
  Prepared prepared(*snapshot, {sweep});
  size_t parts = 1;
  while (prepared.run->work(0) == Progress::kMore) ++parts;
  EXPECT_GE(parts, limits::kMaxRays / 256);
  ASSERT_EQ(prepared.result.blocks[0].t.size(), limits::kMaxRays);
  for (size_t begin = 0; begin < limits::kMaxRays; begin += 16'384) {
    const BlockResult expected = run_block(*snapshot, rotated.part(begin, begin + 16'384));
    const auto first = prepared.result.blocks[0].t.begin() + static_cast<std::ptrdiff_t>(begin);
    ASSERT_TRUE(std::equal(expected.t.begin(), expected.t.end(), first)) << begin;
  }
}

TEST(BatchRunTest, ABatchWithoutQueriesIsDoneAtTheFirstCall) {
  const SnapshotPtr snapshot = snapshot_of(world_of(1));
  Prepared prepared(*snapshot, {many_rays(RayMode::kFirst, 0)});
  EXPECT_EQ(prepared.run->work(0), Progress::kDone);
  EXPECT_EQ(prepared.run->work(0), Progress::kBegun) << "kDone is returned once";
}

TEST(BatchRunTest, CheapQueriesRunInLargeChunks) {
  const SnapshotPtr snapshot = snapshot_of(world_of(1));
  const std::vector<OwnedBlock> blocks = {many_balls(256, StaticDetail::kInstances)};
  Prepared prepared(*snapshot, blocks);
  EXPECT_EQ(prepared.run->work(0), Progress::kDone);
}

TEST(BatchRunTest, ExpensiveQueriesRunInSmallChunks) {
  QueryWorld world;
  for (Id id = 1; id <= 5'000; ++id) world.objects.push_back(ball_object(id, {0, 0, 0}));
  const SnapshotPtr snapshot = snapshot_of(world);
  OwnedBlock block = one_ball({}, 1);
  block.points.assign(3 * 256, 0);
  block.settings.max_results = 1;
  const std::vector<OwnedBlock> blocks = {block};
  Prepared prepared(*snapshot, blocks);
  int turns = 1;
  while (prepared.run->work(0) == Progress::kMore) ++turns;
  EXPECT_GE(turns, 256 * 5'000 / 32'768) << "a turn is split after a bounded number of tests";
}

TEST(BatchRunTest, ThreadsShareABlockOfFewExpensiveQueries) {
  QueryWorld world;
  for (Id id = 1; id <= 5'000; ++id) world.objects.push_back(ball_object(id, {0, 0, 0}));
  const SnapshotPtr snapshot = snapshot_of(world);
  OwnedBlock block = one_ball({}, 1);
  constexpr size_t kQueries = 64;
  block.points.assign(3 * kQueries, 0);
  block.settings.max_results = 1;
  std::atomic<std::thread::id> slow;
  std::atomic<bool> slow_waits{false}, released{false};
  RunOptions options;
  options.stop = [&] {
    if (std::this_thread::get_id() != slow.load()) return absl::OkStatus();
    slow_waits = true;
    while (!released) std::this_thread::yield();
    return absl::OkStatus();
  };
  Prepared prepared(*snapshot, {block}, options);
  ASSERT_EQ(prepared.run->work(0), Progress::kMore) << "the block is a single chunk, which is split";
  std::thread first([&] {
    slow = std::this_thread::get_id();
    while (prepared.run->work(0) == Progress::kMore) {
    }
  });
  while (!slow_waits) std::this_thread::yield();
  const uint64_t work_before = prepared.run->work_done();
  while (prepared.run->work(0) == Progress::kMore) {
  }
  EXPECT_GE(prepared.run->work_done() - work_before, kQueries / 3 * 5'000) << "half of the remainder is free to be run";
  released = true;
  first.join();
  EXPECT_EQ(prepared.result.blocks[0].counts.size(), kQueries);
}

TEST(BatchRunTest, WithAClockATurnTakesChunksUntilTheTimeIsUp) {
  const SnapshotPtr snapshot = snapshot_of(world_of(1));
  const std::vector<OwnedBlock> blocks = {many_balls(2'560, StaticDetail::kInstances)};
  uint64_t now = 0;
  RunOptions options;
  options.clock = [&now] { return now += 10; };
  Prepared prepared(*snapshot, blocks, options);
  int turns = 1;
  while (prepared.run->work(50) == Progress::kMore) ++turns;
  EXPECT_EQ(turns, 3) << "ten chunks read the clock once each, and every turn twice more at both ends";
  EXPECT_EQ(prepared.run->cost(0).nanoseconds, 60u + 60 + 30) << "from the second reading of a turn to its last";
}

TEST(BatchRunTest, AThreadThatLostItsCoreContinuesUntilItsCpuTimeIsUp) {
  const SnapshotPtr snapshot = snapshot_of(world_of(1));
  const std::vector<OwnedBlock> blocks = {many_balls(2'560, StaticDetail::kInstances)};
  uint64_t now = 0, worked = 0;
  RunOptions options;
  options.clock = [&now] { return now += 1'000; };
  options.work_clock = [&worked] { return worked += 10; };
  Prepared prepared(*snapshot, blocks, options);
  EXPECT_EQ(prepared.run->work(90), Progress::kMore);
  EXPECT_EQ(worked, 110u) << "readings: the beginning, nine chunks, the end";
  EXPECT_EQ(prepared.run->cost(0).nanoseconds, 100u);
}

TEST(BatchRunTest, EachBlockReportsItsCost) {
  const SnapshotPtr snapshot = snapshot_of(world_of(1));
  const std::vector<OwnedBlock> blocks = {many_balls(256, StaticDetail::kInstances),
                                          many_balls(512, StaticDetail::kInstances)};
  uint64_t now = 0;
  RunOptions options;
  options.clock = [&now] { return now += 10; };
  Prepared prepared(*snapshot, blocks, options);
  EXPECT_EQ(prepared.run->work(1'000), Progress::kDone);
  EXPECT_EQ(prepared.run->cost(0).nanoseconds, 20u) << "one chunk, and one reading at its end";
  EXPECT_EQ(prepared.run->cost(1).nanoseconds, 30u);
  EXPECT_EQ(prepared.run->cost().nanoseconds, 50u);
}

TEST(BatchRunTest, AtMostSixteenChunksWaitForAnEarlierOne) {
  const SnapshotPtr snapshot = snapshot_of(world_of(10));
  const std::vector<OwnedBlock> blocks = {many_balls(256 * 40, StaticDetail::kInstances)};
  std::atomic<std::thread::id> slow;
  std::atomic<bool> slow_waits{false}, released{false};
  RunOptions options;
  options.stop = [&] {
    if (std::this_thread::get_id() == slow.load()) {
      slow_waits = true;
      while (!released) std::this_thread::yield();
    }
    return absl::OkStatus();
  };
  Prepared prepared(*snapshot, blocks, options);
  Progress last = Progress::kMore;
  std::thread first([&] {
    slow = std::this_thread::get_id();
    while (last == Progress::kMore) last = prepared.run->work(0);
  });
  while (!slow_waits) std::this_thread::yield();
  size_t turns = 1;
  while (prepared.run->work(0) == Progress::kMore) ++turns;
  EXPECT_EQ(turns, BatchRun::kMaxChunks - 1);
  released = true;
  first.join();
  EXPECT_EQ(last, Progress::kDone) << "the slow thread finishes the batch alone";
  EXPECT_EQ(prepared.result.blocks[0].counts.size(), 256u * 40);
}

TEST(BatchRunTest, AStoppedBatchIsDoneWithItsStatusWhenTheActiveThreadsReturn) {
  const SnapshotPtr snapshot = snapshot_of(world_of(100));
  for (const size_t threads : {1, 4}) {
    std::atomic<int> stop_polls{0};
    RunOptions options;
    options.stop = [&] { return ++stop_polls < 5 ? absl::OkStatus() : absl::CancelledError("gone"); };
    Prepared prepared(*snapshot, mixed_blocks(), options);
    EXPECT_EQ(work_on(*prepared.run, threads), 1);
    EXPECT_EQ(prepared.run->status().code(), absl::StatusCode::kCancelled);
    EXPECT_LE(stop_polls, 5 + static_cast<int>(threads)) << "no thread starts another chunk";
    const Work written = prepared.run->cost().work;
    EXPECT_GT(prepared.run->work_done(), 0u);
    EXPECT_GE(prepared.run->work_done(), written.nodes + written.cells + written.tests);
  }
}

// Tests that a run polls RunOptions::stop at least once per 100,000 triangle tests. Rays that hit thousands of
// triangles are the hard case: a call of the kernels cannot be interrupted and traces many rays, each of which takes
// tens of microseconds.
TEST(BatchRunTest, RaysThroughThousandsOfTrianglesPollTheStopInBoundedWork) {
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
  uint64_t stop_polls = 0;
  RunOptions options;
  options.stop = [&] {
    ++stop_polls;
    return absl::OkStatus();
  };
  Prepared prepared(*snapshot, blocks, options);
  work_on(*prepared.run, 1);
  EXPECT_GE(prepared.run->cost().work.tests, kRays * 100);
  EXPECT_GE(stop_polls, prepared.run->cost().work.tests / 100'000);
}

TEST(BatchRunTest, ColumnsThatWereNotRequestedAreNeverTouched) {
  const SnapshotPtr snapshot = snapshot_of(world_of(10));
  std::vector<OwnedBlock> blocks = {many_rays(RayMode::kFirst, 40), many_rays(RayMode::kAll, 40)};
  for (OwnedBlock& block : blocks) block.settings.columns = {Column::kId};
  Prepared prepared(*snapshot, blocks);
  work_on(*prepared.run, 1);
  for (const BlockResult& block : prepared.result.blocks) {
    EXPECT_FALSE(block.ids.empty());
    EXPECT_THAT(block.t, IsEmpty());
    EXPECT_THAT(block.triangles, IsEmpty());
    EXPECT_THAT(block.points, IsEmpty());
  }
}

}  // namespace
}  // namespace locus::test
