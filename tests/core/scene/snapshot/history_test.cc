// Tests which history a scene keeps, and when it drops records.
#include "core/scene/snapshot/history.h"

#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

class HistoryTest : public ::testing::Test {
 protected:
  static SceneSpec spec(uint32_t ticks, uint64_t bytes) {
    SceneSpec spec;
    spec.history = {ticks, bytes};
    return spec;
  }

  // Applies `ticks` batches, each `stride` ticks after the previous batch; each batch moves 1000 points.
  static void live(Scene& scene, uint64_t ticks, uint64_t stride = 1) {
    std::vector<uint64_t> ids(1000);
    for (size_t i = 0; i < ids.size(); ++i) ids[i] = i + 1;
    UpdateBatch batch;
    batch.upsert = true;
    for (uint64_t tick = 1; tick <= ticks; ++tick) {
      const float place[3] = {static_cast<float>(tick), 0, 0};
      InsertColumns insert;
      insert.ids = ids;
      insert.positions = place;
      batch.inserts = {insert};
      batch.tick = scene.latest()->tick + stride;
      ASSERT_TRUE(scene.apply(batch).ok());
    }
  }
  static uint32_t recorded(const Scene& scene) { return scene.status().recorded_ticks; }
};

TEST_F(HistoryTest, IsOffByDefault) {
  Scene scene("scene", {}, 1, StaticSet::empty());
  live(scene, 5);
  EXPECT_EQ(recorded(scene), 0u);
  EXPECT_EQ(scene.status().history_bytes, 0u);
  EXPECT_EQ(scene.latest()->history, nullptr);
  EXPECT_EQ(scene.latest()->oldest_tick(), 5u);
}

TEST_F(HistoryTest, KeepsTheConfiguredNumberOfTicks) {
  Scene scene("scene", spec(4, uint64_t{1} << 30), 1, StaticSet::empty());
  live(scene, 20);
  EXPECT_EQ(recorded(scene), 4u);
  EXPECT_EQ(scene.latest()->oldest_tick(), 16u);
}

TEST_F(HistoryTest, TicksThatDoNotFitAreForgottenEarlyAndCounted) {
  Scene enough("enough", spec(4, uint64_t{1} << 30), 1, StaticSet::empty());
  live(enough, 20);
  EXPECT_EQ(enough.status().past_limit, PastLimit::kTicks);
  EXPECT_EQ(enough.status().forgotten_ticks, 0u);
  Scene scene("scene", spec(300, 500'000), 1, StaticSet::empty());
  live(scene, 20);
  EXPECT_TRUE(forgets_early(scene.status().past_limit));
  EXPECT_LT(recorded(scene), 20u);
  EXPECT_EQ(scene.status().forgotten_ticks, 20 - recorded(scene));
}

TEST_F(HistoryTest, SkippedTicksCountTowardsTheLimit) {
  Scene scene("scene", spec(10, uint64_t{1} << 30), 1, StaticSet::empty());
  live(scene, 20, 5);
  EXPECT_EQ(scene.latest()->oldest_tick(), 90u);
  live(scene, 1, 1000);
  EXPECT_EQ(scene.latest()->oldest_tick(), 100u);
}

TEST_F(HistoryTest, TrimmingDropsTheOldestTicksAndNothingElse) {
  Scene scene("scene", spec(20, uint64_t{1} << 30), 1, StaticSet::empty());
  live(scene, 20);
  const SnapshotPtr before = scene.latest();
  const uint64_t bytes = before->history->bytes;
  EXPECT_EQ(scene.trim_history(bytes), 0u);
  EXPECT_EQ(scene.latest(), before);
  const uint64_t freed = scene.trim_history(bytes / 2);
  const SnapshotPtr after = scene.latest();
  EXPECT_EQ(freed, bytes - after->history->bytes);
  EXPECT_GE(freed, bytes / 2);
  EXPECT_EQ(after->revision, before->revision);
  EXPECT_EQ(after->tick, before->tick);
  EXPECT_EQ(after->objects.size(), before->objects.size());
  EXPECT_EQ(after->past_limit, PastLimit::kMemory);
  EXPECT_EQ(after->history->records.back(), before->history->records.back());
  EXPECT_GT(after->oldest_tick(), before->oldest_tick());
  live(scene, 3);
  EXPECT_EQ(scene.latest()->revision, before->revision + 3);
  const uint64_t left = scene.status().history_bytes;
  EXPECT_EQ(scene.trim_history(0), left);
  EXPECT_EQ(recorded(scene), 0u);
  live(scene, 3);
  EXPECT_EQ(recorded(scene), 3u);
}

TEST_F(HistoryTest, TheSummaryOfARevisionFollowsTrimming) {
  Scene scene("scene", spec(20, uint64_t{1} << 30), 1, StaticSet::empty());
  live(scene, 20);
  EXPECT_EQ(scene.known_summary(), std::nullopt);
  EXPECT_EQ(scene.summary().oldest_tick, 0u);
  EXPECT_EQ(scene.known_summary()->oldest_tick, 0u);
  EXPECT_GT(scene.trim_history(0), 0u);
  EXPECT_EQ(scene.known_summary(), std::nullopt);
  EXPECT_EQ(scene.summary().oldest_tick, 20u);
  EXPECT_EQ(scene.known_summary()->oldest_tick, 20u);
}

TEST_F(HistoryTest, KeepsAtMostTheConfiguredBytes) {
  constexpr uint64_t kBytes = 1'000'000;
  Scene scene("scene", spec(1000, kBytes), 1, StaticSet::empty());
  live(scene, 100);
  EXPECT_GT(recorded(scene), 2u);
  EXPECT_LT(recorded(scene), 50u);
  EXPECT_LE(scene.status().history_bytes, kBytes);
  EXPECT_GT(scene.status().history_bytes, kBytes / 2);
  EXPECT_EQ(scene.latest()->oldest_tick(), 100 - recorded(scene));
}

TEST_F(HistoryTest, KeepsNoRecordIfOneTickExceedsTheBytes) {
  Scene scene("scene", spec(10, 1000), 1, StaticSet::empty());
  live(scene, 5);
  EXPECT_EQ(recorded(scene), 0u);
  EXPECT_EQ(scene.latest()->oldest_tick(), 5u);
}

TEST_F(HistoryTest, ATickWithoutChangesCostsAlmostNoMemory) {
  Scene scene("scene", spec(100, uint64_t{1} << 30), 1, StaticSet::empty());
  live(scene, 1);
  const uint64_t before = scene.status().history_bytes;
  for (uint64_t tick = 2; tick <= 11; ++tick) {
    UpdateBatch batch;
    batch.tick = tick;
    ASSERT_TRUE(scene.apply(batch).ok());
  }
  EXPECT_EQ(recorded(scene), 11u);
  EXPECT_LT(scene.status().history_bytes - before, 10'000u);
}

TEST_F(HistoryTest, RestartingTicksDropsTheHistory) {
  Scene scene("scene", spec(100, uint64_t{1} << 30), 1, StaticSet::empty());
  live(scene, 5);
  UpdateBatch restart;
  restart.restart_ticks = true;
  restart.tick = 2;
  const uint64_t before = scene.latest()->revision;
  EXPECT_EQ(scene.apply(restart)->revision, before + 1);
  EXPECT_EQ(recorded(scene), 0u);
  EXPECT_EQ(scene.latest()->oldest_tick(), 2u);
  live(scene, 3);
  EXPECT_EQ(scene.latest()->oldest_tick(), 2u);
  EXPECT_EQ(scene.latest()->tick, 5u);
}

TEST_F(HistoryTest, RestartingAtTheSameTickDropsTheHistoryAndIsARevision) {
  Scene scene("scene", spec(100, uint64_t{1} << 30), 1, StaticSet::empty());
  live(scene, 5);
  UpdateBatch restart;
  restart.restart_ticks = true;
  const uint64_t before = scene.latest()->revision;
  EXPECT_EQ(scene.apply(restart)->revision, before + 1);
  EXPECT_EQ(recorded(scene), 0u);
  EXPECT_EQ(scene.apply(restart)->revision, before + 1);
}

TEST_F(HistoryTest, TheHistoryReportsWhyItBeginsAtItsOldestTick) {
  constexpr uint64_t kPlenty = uint64_t{1} << 30;
  Scene off("scene", {}, 1, StaticSet::empty());
  Scene young("scene", spec(10, kPlenty), 1, StaticSet::empty());
  Scene old("scene", spec(3, kPlenty), 1, StaticSet::empty());
  Scene large("scene", spec(10, 1000), 1, StaticSet::empty());
  for (Scene* scene : {&off, &young, &old, &large}) live(*scene, 5);
  EXPECT_EQ(off.latest()->past_limit, PastLimit::kOff);
  EXPECT_EQ(young.latest()->past_limit, PastLimit::kBegan);
  EXPECT_EQ(old.latest()->past_limit, PastLimit::kTicks);
  EXPECT_EQ(large.latest()->past_limit, PastLimit::kBytes);
  UpdateBatch restart;
  restart.restart_ticks = true;
  ASSERT_TRUE(old.apply(restart).ok());
  EXPECT_EQ(old.latest()->past_limit, PastLimit::kBegan);
}

TEST_F(HistoryTest, ARestoredHistoryReportsTheTickLimitOnceItIsLongEnough) {
  HistoryRecorder recorder({2, uint64_t{1} << 30});
  recorder.restore(true);
  recorder.close(5, {}, StaticSet::empty(), {}, 6);
  recorder.close(6, {}, StaticSet::empty(), {}, 7);
  EXPECT_EQ(recorder.limit(), PastLimit::kRestored);
  recorder.close(7, {}, StaticSet::empty(), {}, 8);
  EXPECT_EQ(recorder.limit(), PastLimit::kTicks);
}

TEST_F(HistoryTest, ARestoredSceneWithoutHistoryReportsNoLoss) {
  HistoryRecorder recorder({2, uint64_t{1} << 30});
  recorder.restore(false);
  EXPECT_EQ(recorder.limit(), PastLimit::kBegan);
}

// The effect of a batch must not depend on the memory limit, so that a replay of the log has the same effect.
TEST_F(HistoryTest, RestartingTicksIsARevisionEvenIfNoRecordIsKept) {
  Scene scene("scene", spec(100, 1), 1, StaticSet::empty());
  live(scene, 5);
  EXPECT_EQ(recorded(scene), 0u);
  UpdateBatch restart;
  restart.restart_ticks = true;
  const uint64_t before = scene.latest()->revision;
  EXPECT_EQ(scene.apply(restart)->revision, before + 1);
  EXPECT_EQ(scene.apply(restart)->revision, before + 1);
}

TEST_F(HistoryTest, ARefusedBatchEndsNoTick) {
  Scene scene("scene", spec(100, uint64_t{1} << 30), 1, StaticSet::empty());
  live(scene, 5);
  const uint64_t unknown = 5000;
  UpdateBatch batch;
  batch.tick = 9;
  batch.all_or_nothing = true;
  batch.remove_ids = {&unknown, 1};
  EXPECT_FALSE(scene.apply(batch).ok());
  EXPECT_EQ(recorded(scene), 5u);
  EXPECT_EQ(scene.latest()->tick, 5u);
}

}  // namespace
}  // namespace locus::test
