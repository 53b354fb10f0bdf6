#include "server/scheduling/snapshotter.h"

#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "core/scene/recovery.h"
#include "tests/support/memory_log.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;

class SnapshotterTest : public testing::Test {
 protected:
  SnapshotterTest() {
    const absl::StatusOr<Registry::CreatedScene> created = registry_.create_scene("arena", {}, 5, "", false);
    EXPECT_TRUE(created.ok()) << created.status();
    scene_ = created->scene;
  }

  // Returns options for a snapshotter that checks every millisecond and snapshots after a few records.
  SnapshotterOptions eager() {
    SnapshotterOptions options;
    options.log_bytes = 2'000;
    options.poll_interval = milliseconds(1);
    options.retry_after = milliseconds(1);
    options.on_snapshot = [this](const Scene&, const absl::StatusOr<uint64_t>& bytes) {
      if (!bytes.ok()) ++reported_failures_;
    };
    return options;
  }

  // Applies `count` batches, each of which inserts one point and appends one record to the log.
  void apply(uint64_t count) {
    for (uint64_t i = 0; i < count; ++i) {
      const std::vector<uint64_t> ids = {++last_id_};
      const std::vector<float> position = {static_cast<float>(last_id_), 0, 0};
      UpdateBatch batch;
      batch.inserts.emplace_back();
      batch.inserts[0].ids = ids;
      batch.inserts[0].positions = position;
      EXPECT_TRUE(scene_->apply(batch).ok());
    }
  }

  void wait_for_snapshots(const Snapshotter& snapshotter, uint64_t count) {
    while (snapshotter.stats().written < count) std::this_thread::yield();
  }

  // Simulates a crash and returns the scene that is recovered from the log.
  ScenePtr recovered() {
    crashed_ = std::make_unique<test::MemoryLog>(log_.crash());
    absl::StatusOr<ScenePtr> scene =
        recover_scene(*crashed_, crashed_->stored_scenes().front(), [](const MeshKey&) { return MeshPtr(); });
    EXPECT_TRUE(scene.ok()) << scene.status();
    return scene.value_or(nullptr);
  }

  test::MemoryLog log_;
  Registry registry_{&log_};
  ScenePtr scene_;
  uint64_t last_id_ = 0;
  std::atomic<uint64_t> reported_failures_{0};
  std::unique_ptr<test::MemoryLog> crashed_;
};

TEST_F(SnapshotterTest, ASnapshotReplacesManyRecordsWhileTheSceneChanges) {
  const Snapshotter snapshotter(registry_, &log_, eager());
  apply(200);
  wait_for_snapshots(snapshotter, 1);
  EXPECT_GT(snapshotter.stats().bytes, 0u);
  const LogPosition position = scene_->log_position();
  EXPECT_GT(position.snapshot_sequence, 0u);
  apply(50);
  const ScenePtr again = recovered();
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(again->latest()->revision, scene_->latest()->revision);
  EXPECT_EQ(again->latest()->objects.size(), 250u);
}

TEST_F(SnapshotterTest, FewRecordsCauseNoSnapshot) {
  apply(3);
  std::atomic<bool> reported{false};
  SnapshotterOptions options = eager();
  options.log_bytes = scene_->log_position().bytes;
  options.on_snapshot = [&reported](const Scene&, const absl::StatusOr<uint64_t>&) { reported = true; };
  {
    const Snapshotter snapshotter(registry_, &log_, options);
    std::this_thread::sleep_for(milliseconds(20));
    EXPECT_EQ(snapshotter.stats().written, 0u);
    // Appends one more record, which makes a snapshot due, and waits for this snapshot. The snapshot shows that the
    // snapshotter checks the scene. So the snapshotter wrote nothing before only because no snapshot was due.
    apply(1);
    wait_for_snapshots(snapshotter, 1);
  }
  EXPECT_TRUE(reported);
}

TEST_F(SnapshotterTest, AFailedSnapshotIsReportedAndRetried) {
  apply(200);
  log_.fail_with(absl::ResourceExhaustedError("full"));
  const Snapshotter snapshotter(registry_, &log_, eager());
  while (snapshotter.stats().failed < 2) std::this_thread::yield();
  EXPECT_EQ(snapshotter.stats().written, 0u);
  EXPECT_GE(reported_failures_, 1u);
  log_.fail_with(absl::OkStatus());
  wait_for_snapshots(snapshotter, 1);
  EXPECT_EQ(recovered()->latest()->objects.size(), 200u);
}

TEST_F(SnapshotterTest, ASceneThatWasDeletedDoesNotKeepTheOthersFromTheirSnapshots) {
  apply(200);
  EXPECT_TRUE(log_.delete_scene(scene_->log_key()).ok());  // as if the registry were about to drop the scene
  scene_ = registry_.create_scene("beta", {}, 6, "", false)->scene;
  apply(200);
  const Snapshotter snapshotter(registry_, &log_, eager());
  wait_for_snapshots(snapshotter, 1);
  EXPECT_EQ(snapshotter.stats().failed, 0u);
}

TEST_F(SnapshotterTest, WithoutALogItDoesNothing) {
  Registry registry;
  const Snapshotter snapshotter(registry, nullptr, eager());
  EXPECT_EQ(snapshotter.stats().written, 0u);
}

}  // namespace
}  // namespace locus::server
