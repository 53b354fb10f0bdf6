// Tests which records a scene appends to its log and when it appends them, and how the scene handles errors of the log.
#include "core/scene/log/scene_journal.h"

#include <gmock/gmock.h>

#include <thread>

#include "core/scene/log/state_writer.h"
#include "core/scene/recovery.h"
#include "tests/support/memory_log.h"
#include "tests/support/scene_difference.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

using ::testing::IsEmpty;

class SceneJournalTest : public SceneFixture {
 protected:
  SceneJournalTest() {
    logged_ = create("logged", {});
    key_ = logged_->log_key();
  }

  ScenePtr create(const std::string& name, const SceneSpec& spec) {
    return registry_.create_scene(name, spec, kEpoch, "", false)->scene;
  }

  std::vector<MemoryLog::Record> records(SceneKey key) { return log_.crash(100).scenes.at(key).records; }
  uint64_t sequence() const { return logged_->log_position().sequence; }

  static std::vector<const UpdateBatch*> borrowed(const std::vector<UpdateBatch>& batches) {
    std::vector<const UpdateBatch*> result;
    for (const UpdateBatch& batch : batches) result.push_back(&batch);
    return result;
  }

  MemoryLog log_;
  Registry registry_{&log_};
  ScenePtr logged_;
  SceneKey key_ = 0;
};

TEST_F(SceneJournalTest, EachRevisionIsARecordWithItsEpochAndBatch) {
  ASSERT_TRUE(logged_->apply(numbered(with(points({1}, {0, 0, 0})), 9, 1)).ok());
  ASSERT_TRUE(logged_->apply(with(move_to({1}, {1, 0, 0}))).ok());
  const auto kept = records(key_);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0].epoch, kEpoch);
  EXPECT_EQ(kept[0].writer, 9u);
  EXPECT_EQ(kept[0].batch, 1u);
  EXPECT_EQ(kept[1].writer, 0u);
  EXPECT_EQ(sequence(), 2u);
}

TEST_F(SceneJournalTest, BatchesAnsweredByTheWriterTableAreNotLogged) {
  const UpdateBatch first = numbered(with(points({1}, {0, 0, 0})), 9, 1);
  ASSERT_TRUE(logged_->apply(first).ok());
  EXPECT_TRUE(logged_->apply(first)->duplicate);
  EXPECT_FALSE(logged_->apply(numbered(first, 9, 5)).ok());
  const UpdateBatch move = numbered(with(move_to({1}, {1, 0, 0})), 9, 1);
  EXPECT_TRUE((*logged_->apply_joined(borrowed({move, move})))[1]->duplicate);
  EXPECT_EQ(sequence(), 1u);
}

TEST_F(SceneJournalTest, ABatchOfWrongFormIsNotLogged) {
  EXPECT_FALSE(logged_->apply(with(points({1, 2, 3}, {0, 0, 0, 1, 1, 1}))).ok());
  EXPECT_EQ(sequence(), 0u);
}

TEST_F(SceneJournalTest, SeveralBatchesAreLoggedByOneAppendAndGetTheSameAcksAsAlone) {
  const UpdateBatch first = numbered(with(points({1}, {0, 0, 0})), 9, 1);
  const UpdateBatch refused = [&] {
    UpdateBatch batch = removing({77});
    batch.all_or_nothing = true;
    return batch;
  }();
  const std::vector<UpdateBatch> batches = {first,
                                            first,
                                            refused,
                                            numbered(with(move_to({1}, {1, 0, 0})), 9, 2),
                                            with(points({1, 2, 3}, {0, 0, 0, 1, 1, 1})),
                                            removing({77})};
  const auto acks = logged_->apply_each(borrowed(batches));
  ASSERT_TRUE(acks.ok()) << acks.status();
  ASSERT_EQ(acks->size(), batches.size());
  for (size_t i = 0; i < batches.size(); ++i) EXPECT_EQ(ack_difference((*acks)[i], scene_.apply(batches[i])), "") << i;
  EXPECT_EQ(logged_->latest()->revision, 2u);
  EXPECT_EQ(log_.appends(), 1u);
  EXPECT_EQ(sequence(), 5u);
}

TEST_F(SceneJournalTest, LeadingDuplicatesAmongSeveralBatchesAreNotLogged) {
  const UpdateBatch first = numbered(with(points({1}, {0, 0, 0})), 9, 1);
  ASSERT_TRUE(logged_->apply(first).ok());
  const auto acks = logged_->apply_each(borrowed({first, first}));
  EXPECT_TRUE((*acks)[0]->duplicate && (*acks)[1]->duplicate);
  EXPECT_EQ(log_.appends(), 1u);
}

TEST_F(SceneJournalTest, AnEmptyListOfBatchesAppendsNoRecord) {
  EXPECT_THAT(*logged_->apply_each({}), IsEmpty());
  EXPECT_EQ(log_.appends(), 0u);
}

TEST_F(SceneJournalTest, AfterALogErrorNothingHasChangedAndTheNextAttemptSucceeds) {
  registry_.add_mesh("m", mesh_).IgnoreError();
  const UpdateBatch insert = numbered(with(points({1}, {0, 0, 0})), 9, 1);
  const UpdateBatch move = numbered(with(move_to({1}, {1, 0, 0})), 9, 1);
  log_.fail_with(absl::ResourceExhaustedError("the disk is full"));
  EXPECT_EQ(logged_->apply(insert).status(), absl::ResourceExhaustedError("the disk is full"));
  EXPECT_EQ(logged_->apply_joined(borrowed({move, move})).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(logged_->apply_each(borrowed({insert, move})).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(logged_->change_instances(placing(placement({5}, {0, 0, 0}))).status().code(),
            absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(logged_->latest()->revision, 0u);
  EXPECT_EQ(logged_->freeze().writers.size(), 0u);
  EXPECT_EQ(sequence(), 0u);
  log_.fail_with(absl::OkStatus());
  EXPECT_EQ(logged_->apply(insert)->revision, 1u);
  EXPECT_EQ(logged_->change_instances(placing(placement({5}, {0, 0, 0})))->revision, 2u);
  EXPECT_EQ(sequence(), 2u);
}

TEST_F(SceneJournalTest, OnlySyncedRecordsSurviveACrashAndAStaticChangeSyncsEarlierRecords) {
  registry_.add_mesh("m", mesh_).IgnoreError();
  SceneSpec spec;
  spec.durability = Durability::kMemory;
  const ScenePtr soon = create("soon", spec);
  ASSERT_TRUE(soon->apply(with(points({1}, {0, 0, 0}))).ok());
  EXPECT_THAT(log_.crash().scenes.at(soon->log_key()).records, IsEmpty());
  ASSERT_TRUE(soon->change_instances(placing(placement({5}, {0, 0, 0}))).ok());
  EXPECT_EQ(log_.crash().scenes.at(soon->log_key()).records.size(), 2u);
  ASSERT_TRUE(logged_->apply(with(points({1}, {0, 0, 0}))).ok());
  EXPECT_EQ(log_.crash().scenes.at(key_).records.size(), 1u);
}

TEST_F(SceneJournalTest, ThePositionCountsTheBytesLoggedSinceTheSnapshot) {
  ASSERT_TRUE(logged_->apply(with(points({1}, {0, 0, 0}))).ok());
  const uint64_t first = logged_->log_position().bytes;
  EXPECT_EQ(first, records(key_)[0].bytes->size());
  FrozenScene frozen = logged_->freeze();
  EXPECT_EQ(frozen.sequence, 1u);
  ASSERT_TRUE(logged_->apply(with(move_to({1}, {1, 0, 0}))).ok());
  const uint64_t both = logged_->log_position().bytes;
  logged_->snapshot_written(frozen.sequence, frozen.log_bytes);
  EXPECT_EQ(logged_->log_position().snapshot_sequence, 1u);
  EXPECT_EQ(logged_->log_position().sequence, 2u);
  EXPECT_EQ(logged_->log_position().bytes, both - first);
  const FrozenScene second = logged_->freeze();
  logged_->snapshot_written(second.sequence, second.log_bytes);
  EXPECT_EQ(logged_->log_position().bytes, 0u);
  logged_->snapshot_written(frozen.sequence, frozen.log_bytes);
  EXPECT_EQ(logged_->log_position().snapshot_sequence, 2u);
}

TEST_F(SceneJournalTest, ReadersSeeThePreviousRevisionWhileTheWriterWaitsForTheDisk) {
  ASSERT_TRUE(logged_->apply(with(points({1}, {0, 0, 0}))).ok());
  log_.hold();
  std::thread writer([&] { EXPECT_EQ(logged_->apply(with(move_to({1}, {1, 0, 0})))->revision, 2u); });
  log_.wait_for_writer();
  EXPECT_EQ(logged_->latest()->revision, 1u);
  EXPECT_TRUE(logged_->view({}, Scene::Deadline::max()).ok());
  EXPECT_TRUE(logged_->pin({}, Scene::Deadline::max()).ok());
  EXPECT_EQ(logged_->status().pending_changes, 0u);
  EXPECT_EQ(sequence(), 1u);
  EXPECT_EQ(*registry_.find_scene("logged"), logged_);
  log_.release();
  writer.join();
  EXPECT_EQ(logged_->latest()->revision, 2u);
}

TEST_F(SceneJournalTest, DeletingASceneWaitsUntilRunningUpdatesAreAcknowledged) {
  log_.hold();
  std::thread writer([&] { EXPECT_TRUE(logged_->apply(with(points({1}, {0, 0, 0}))).ok()); });
  log_.wait_for_writer();
  std::thread deleter([&] { EXPECT_TRUE(registry_.delete_scene("logged").ok()); });
  log_.release();
  writer.join();
  deleter.join();
  EXPECT_EQ(logged_->apply(with(points({2}, {0, 0, 0}))).status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(log_.crash().scenes, IsEmpty());
}

}  // namespace
}  // namespace locus::test
