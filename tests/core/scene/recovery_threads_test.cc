// Tests writers, readers, snapshots and static changes at the same time with a slow log: every acknowledged change is
// recovered.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/scene/log/state_writer.h"
#include "core/scene/recovery.h"
#include "tests/support/memory_log.h"
#include "tests/support/scene_difference.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

class RecoveryThreadsTest : public SceneFixture {
 protected:
  static constexpr uint64_t kWriters = 3;

  RecoveryThreadsTest() {
    EXPECT_TRUE(registry_.add_mesh("m", mesh_).ok());
    SceneSpec spec;
    spec.history = {4, uint64_t{1} << 30};
    logged_ = registry_.create_scene("busy", spec, kEpoch, "", false)->scene;
    log_.take(std::chrono::microseconds(200));
  }

  // Applies `batches` batches of `writer`. Each batch moves the writer's own object: the object's x coordinate is the
  // number of the last batch.
  void write(uint64_t writer, uint64_t batches) {
    for (uint64_t number = 1; number <= batches; number += 2) {
      std::vector<Id> ids = {writer};
      std::vector<float> first = {static_cast<float>(number), 0, 0}, second = {static_cast<float>(number + 1), 0, 0};
      UpdateBatch batch, next;
      InsertColumns insert;
      insert.ids = ids;
      insert.positions = first;
      batch.inserts = {insert};
      batch.upsert = true;
      batch.tick = number / 10;
      batch.writer = next.writer = writer;
      batch.batch = number;
      next.batch = number + 1;
      MoveColumns move;
      move.ids = ids;
      move.positions = second;
      next.moves = {move};
      const UpdateBatch* const both[] = {&batch, &next};
      const auto acks = logged_->apply_each(both);
      ASSERT_TRUE(acks.ok()) << acks.status();
      ASSERT_TRUE((*acks)[0].ok() && (*acks)[1].ok());
      EXPECT_EQ((*acks)[1]->revision, (*acks)[0]->revision + 1);
    }
  }

  void change(uint64_t changes) {
    for (Id id = 1000; id < 1000 + changes; ++id) {
      std::vector<Id> placed = {id}, removed = {id - 1};
      std::vector<double> translations = {0, 0, 0};
      StaticChange change;
      PlacementColumns place;
      place.mesh = mesh_;
      place.ids = placed;
      place.translations = translations;
      change.place = {place};
      if (id > 1000) change.remove_ids = removed;
      EXPECT_TRUE(logged_->change_instances(change).ok());
    }
  }

  void keep_snapshots(const std::atomic<bool>& done) {
    while (!done) {
      FrozenScene frozen = logged_->freeze();
      const uint64_t sequence = frozen.sequence, bytes = frozen.log_bytes;
      StateWriter state(std::move(frozen));
      ASSERT_TRUE(log_.write_snapshot(logged_->log_key(), sequence, [&state] { return state.next(); }).ok());
      logged_->snapshot_written(sequence, bytes);
      EXPECT_LE(logged_->log_position().snapshot_sequence, logged_->log_position().sequence);
    }
  }

  void read(const std::atomic<bool>& done) {
    uint64_t last = 0;
    while (!done) {
      const SnapshotPtr snapshot = logged_->latest();
      EXPECT_LE(last, snapshot->revision);
      last = snapshot->revision;
      EXPECT_LE(snapshot->statics->size(), 1u);
      EXPECT_TRUE(registry_.find_scene("busy").ok());
    }
  }

  MemoryLog log_;
  Registry registry_{&log_};
  ScenePtr logged_;
};

TEST_F(RecoveryThreadsTest, AllAcknowledgedUpdatesAreRecovered) {
  const uint64_t batches = 2 * scaled_count(300);
  std::atomic<bool> done{false};
  std::vector<std::thread> writers, others;
  for (uint64_t writer = 1; writer <= kWriters; ++writer)
    writers.emplace_back([this, writer, batches] { write(writer, batches); });
  writers.emplace_back([this, batches] { change(batches); });
  others.emplace_back([&] { keep_snapshots(done); });
  for (int i = 0; i < 2; ++i) others.emplace_back([&] { read(done); });
  for (std::thread& thread : writers) thread.join();
  done = true;
  for (std::thread& thread : others) thread.join();

  MemoryLog again(log_.crash());
  const auto recovered = recover_scene(again, again.stored_scenes().front(), [this](const MeshKey&) { return mesh_; });
  ASSERT_TRUE(recovered.ok()) << recovered.status();
  Random random(1);
  EXPECT_EQ(scene_difference(**recovered, *logged_, random), "");
  for (Id writer = 1; writer <= kWriters; ++writer)
    EXPECT_EQ((*recovered)->latest()->objects.find(writer)->shape.position.x, static_cast<double>(batches));
}

}  // namespace
}  // namespace locus::test
