// Tests the memory accounting of snapshots.
#include "core/scene/snapshot/scene_snapshot.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

// Scene whose objects are points at intervals of 1000 along the x axis, stored in several bricks.
class SnapshotBytesTest : public SceneFixture {
 protected:
  static constexpr uint64_t kObjects = 2'000;

  explicit SnapshotBytesTest(const SceneSpec& spec = {}) : SceneFixture(spec) {
    for (Id id = 1; id <= kObjects; ++id) all_.push_back(id);
    std::vector<float> positions;
    for (const Id id : all_) positions.insert(positions.end(), {float(id) * 1000, 0, 0});
    apply(with(points(all_, positions)));
  }

  SnapshotPtr after(const UpdateBatch& batch) {
    apply(batch);
    return scene_.latest();
  }
  // Returns a batch that moves all objects to (`to`, `to`, `to`) at the next tick.
  UpdateBatch step(float to) {
    UpdateBatch batch = with(move_to(all_, std::vector<float>(3 * all_.size(), to)));
    batch.tick = scene_.latest()->tick + 1;
    return batch;
  }

  std::vector<Id> all_;
};

class SnapshotBytesWithPastTest : public SnapshotBytesTest {
 protected:
  static constexpr uint32_t kTicks = 4;
  static SceneSpec remembering() {
    SceneSpec spec;
    spec.history = {kTicks, uint64_t{1} << 30};
    return spec;
  }
  SnapshotBytesWithPastTest() : SnapshotBytesTest(remembering()) {}
};

TEST_F(SnapshotBytesTest, ARevisionHasNoUnsharedBytesWithItself) {
  // The result includes a few words for each level of the grid, which are counted even if the level is shared.
  EXPECT_LT(unshared_bytes(*scene_.latest(), *scene_.latest()), 1'000u);
}

TEST_F(SnapshotBytesTest, FullyReplacedObjectsAreCountedOnce) {
  const SnapshotPtr held = scene_.latest();
  const uint64_t after_one = unshared_bytes(*held, *after(step(1)));
  for (int i = 2; i < 20; ++i) apply(step(float(i)));
  EXPECT_GT(after_one, kObjects * sizeof(Vec3d));
  EXPECT_LE(unshared_bytes(*held, *scene_.latest()), after_one + 1'000);
}

TEST_F(SnapshotBytesTest, SmallReplacementsLeaveFewUnsharedBytes) {
  const SnapshotPtr held = scene_.latest();
  const uint64_t of_one = unshared_bytes(*held, *after(with(move_to({1}, {1, 0, 0}))));
  EXPECT_LT(3 * of_one, unshared_bytes(*held, *after(step(1))));
}

TEST_F(SnapshotBytesTest, UnsharedBytesAreAtMostFourTimesTheReplacedBytes) {
  const SnapshotPtr held = scene_.latest();
  for (int i = 1; i < 5; ++i) {
    apply(step(float(i)));
    EXPECT_LE(unshared_bytes(*held, *scene_.latest()), 4 * (scene_.latest()->replaced_bytes - held->replaced_bytes));
  }
}

TEST_F(SnapshotBytesTest, ReplacedInstancesAreHeld) {
  ASSERT_TRUE(scene_.change_instances(placing(placement({kObjects + 1}, {0, 0, 0}))).ok());
  const SnapshotPtr held = scene_.latest();
  ASSERT_TRUE(scene_.change_instances(placing(placement({kObjects + 2}, {0, 0, 0}))).ok());
  EXPECT_GE(unshared_bytes(*held, *scene_.latest()), held->statics->bytes());
  EXPECT_GE(scene_.latest()->replaced_bytes - held->replaced_bytes, held->statics->bytes());
}

TEST_F(SnapshotBytesWithPastTest, ObjectsKeptByTheHistoryAreNotCountedForReaders) {
  const SnapshotPtr held = scene_.latest();
  for (uint32_t i = 1; i <= kTicks; ++i) apply(step(float(i)));
  EXPECT_LT(unshared_bytes(*held, *scene_.latest()), 1'000u);
}

TEST_F(SnapshotBytesWithPastTest, DroppedHistoryIsCountedForReaders) {
  for (uint32_t i = 1; i <= 2 * kTicks; ++i) apply(step(float(i)));
  const SnapshotPtr held = scene_.latest();
  const uint64_t past = held->history->bytes;
  for (uint32_t i = 1; i <= 3 * kTicks; ++i) apply(step(100 + float(i)));
  EXPECT_GT(unshared_bytes(*held, *scene_.latest()), past);
  EXPECT_LE(unshared_bytes(*held, *scene_.latest()), 4 * (scene_.latest()->replaced_bytes - held->replaced_bytes));
}

TEST_F(SnapshotBytesWithPastTest, HistoryFromBeforeARestartOfTicksIsCountedForReaders) {
  for (uint32_t i = 1; i <= 2 * kTicks; ++i) apply(step(float(i)));
  const SnapshotPtr held = scene_.latest();
  UpdateBatch restart = step(50);
  restart.restart_ticks = true;
  restart.tick = 1;
  apply(restart);
  while (scene_.latest()->tick < held->tick) apply(step(60 + float(scene_.latest()->tick)));
  EXPECT_GT(unshared_bytes(*held, *scene_.latest()), held->history->bytes);
}

}  // namespace
}  // namespace locus::test
