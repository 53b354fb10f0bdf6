// Tests revisions, ticks and batch numbers of writers, through a scene.
#include "core/scene/scene_writer.h"

#include "core/base/limits.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

class SceneWriterTest : public SceneFixture {
 protected:
  static UpdateBatch at_tick(uint64_t tick) {
    UpdateBatch batch;
    batch.tick = tick;
    return batch;
  }

  void expect_gap(const UpdateBatch& batch, uint64_t expected) {
    const absl::Status status = scene_.apply(batch).status();
    expect_refusal(status, absl::StatusCode::kFailedPrecondition, Reason::kBatchGap, "batch");
    EXPECT_EQ(refusal_of(status)->limit_value, static_cast<double>(expected));
    EXPECT_EQ(refusal_of(status)->asked, static_cast<double>(batch.batch));
  }
};

TEST_F(SceneWriterTest, ASceneBeginsAtRevisionAndTickZero) {
  EXPECT_EQ(scene_.latest()->revision, 0u);
  EXPECT_EQ(scene_.latest()->tick, 0u);
  EXPECT_EQ(scene_.latest()->epoch, kEpoch);
}

TEST_F(SceneWriterTest, EachAppliedBatchAddsOneRevision) {
  EXPECT_EQ(apply(with(points({1}, {0, 0, 0}))).revision, 1u);
  EXPECT_EQ(apply(with(move_to({1}, {1, 0, 0}))).revision, 2u);
  EXPECT_EQ(apply(removing({1})).revision, 3u);
  EXPECT_EQ(revision(), 3u);
}

TEST_F(SceneWriterTest, AcksCarryTheEpoch) { EXPECT_EQ(apply({}).epoch, kEpoch); }

TEST_F(SceneWriterTest, AnEmptyBatchMakesNoRevision) {
  const SnapshotPtr before = scene_.latest();
  EXPECT_EQ(apply({}).revision, 0u);
  EXPECT_EQ(scene_.latest(), before);
}

TEST_F(SceneWriterTest, AMoveToTheSamePositionMakesNoRevision) {
  apply(with(points({1}, {1, 2, 3})));
  const UpdateAck ack = apply(with(move_to({1}, {1, 2, 3})));
  EXPECT_EQ(ack.applied, 1u);
  EXPECT_EQ(ack.revision, 1u);
}

TEST_F(SceneWriterTest, ABatchOfRefusedItemsMakesNoRevision) { EXPECT_EQ(apply(removing({1, 2})).revision, 0u); }

TEST_F(SceneWriterTest, ClearOfAnEmptySceneMakesNoRevision) {
  UpdateBatch batch;
  batch.clear = true;
  EXPECT_EQ(apply(batch).revision, 0u);
}

TEST_F(SceneWriterTest, ClearAndInsertOfTheSameObjectsMakesNoRevision) {
  apply(with(balls({1, 2}, {3})));
  UpdateBatch batch = with(balls({1, 2}, {3}));
  batch.clear = true;
  EXPECT_EQ(apply(batch).revision, 1u);
  EXPECT_EQ(ids(), (std::vector<Id>{1, 2}));
}

TEST_F(SceneWriterTest, MovesThereAndBackInOneBatchMakeNoRevision) {
  apply(with(points({1}, {0, 0, 0})));
  EXPECT_EQ(apply(with(move_to({1, 1}, {5, 5, 5, 0, 0, 0}))).revision, 1u);
}

TEST_F(SceneWriterTest, ANewTickAloneMakesARevision) {
  EXPECT_EQ(apply(at_tick(5)).revision, 1u);
  EXPECT_EQ(scene_.latest()->tick, 5u);
  EXPECT_EQ(apply(at_tick(5)).revision, 1u);
}

TEST_F(SceneWriterTest, WithoutATickABatchIsAppliedUnderTheCurrent) {
  apply(at_tick(5));
  EXPECT_EQ(apply(with(points({1}, {0, 0, 0}))).tick, 5u);
}

TEST_F(SceneWriterTest, AnOlderTickIsAppliedUnderTheCurrent) {
  apply(at_tick(5));
  UpdateBatch batch = with(points({1}, {0, 0, 0}));
  batch.tick = 3;
  const UpdateAck ack = apply(batch);
  EXPECT_EQ(ack.tick, 5u);
  EXPECT_EQ(ack.revision, 2u);
  EXPECT_TRUE(object(1).has_value());
}

TEST_F(SceneWriterTest, AnOlderTickAloneMakesNoRevision) {
  apply(at_tick(5));
  EXPECT_EQ(apply(at_tick(4)).revision, 1u);
}

TEST_F(SceneWriterTest, RestartTicksTakesALowerTick) {
  apply(at_tick(5));
  UpdateBatch batch = at_tick(2);
  batch.restart_ticks = true;
  const UpdateAck ack = apply(batch);
  EXPECT_EQ(ack.tick, 2u);
  EXPECT_EQ(ack.revision, 2u);
  EXPECT_EQ(scene_.latest()->tick, 2u);
}

TEST_F(SceneWriterTest, RestartTicksWithoutATickKeepsTheCurrent) {
  apply(at_tick(5));
  UpdateBatch batch;
  batch.restart_ticks = true;
  EXPECT_EQ(apply(batch).tick, 5u);
}

TEST_F(SceneWriterTest, ARepeatedBatchIsNotAppliedAgainAndGetsItsOldAck) {
  const UpdateBatch batch = numbered(with(points({1, 0}, {0, 0, 0})), 9, 1);
  const UpdateAck first = apply(batch);
  apply(with(points({2}, {0, 0, 0})));
  const UpdateAck again = apply(batch);
  EXPECT_FALSE(first.duplicate);
  EXPECT_TRUE(again.duplicate);
  EXPECT_EQ(again.revision, first.revision);
  EXPECT_EQ(again.applied, 1u);
  EXPECT_EQ(again.refused, 1u);
  EXPECT_EQ(again.errors.size(), 1u);
  EXPECT_EQ(revision(), 2u);
}

TEST_F(SceneWriterTest, AnOlderRepeatedBatchIsADuplicateAtTheCurrentRevision) {
  apply(numbered(with(points({1}, {0, 0, 0})), 9, 1));
  apply(numbered(removing({1}), 9, 2));
  const UpdateAck ack = apply(numbered(with(points({1}, {0, 0, 0})), 9, 1));
  EXPECT_TRUE(ack.duplicate);
  EXPECT_EQ(ack.applied, 0u);
  EXPECT_EQ(ack.refused, 0u);
  EXPECT_EQ(ack.revision, 2u);
  EXPECT_EQ(ack.epoch, kEpoch);
  EXPECT_TRUE(ids().empty());
}

TEST_F(SceneWriterTest, AGapIsRefusedWithTheNumberExpected) {
  apply(numbered({}, 9, 1));
  expect_gap(numbered(with(points({1}, {0, 0, 0})), 9, 3), 2);
  EXPECT_TRUE(ids().empty());
}

TEST_F(SceneWriterTest, AnUnknownWriterMustStartAtBatchOne) { expect_gap(numbered({}, 9, 2), 1); }

TEST_F(SceneWriterTest, ARefusedBatchDoesNotUseUpItsNumber) {
  UpdateBatch batch = numbered(removing({1}), 9, 1);
  batch.all_or_nothing = true;
  EXPECT_FALSE(scene_.apply(batch).ok());
  const UpdateAck ack = apply(numbered(with(points({1}, {0, 0, 0})), 9, 1));
  EXPECT_FALSE(ack.duplicate);
  EXPECT_EQ(ack.applied, 1u);
}

TEST_F(SceneWriterTest, ABatchThatChangesNothingUsesUpItsNumber) {
  apply(numbered({}, 9, 1));
  EXPECT_TRUE(apply(numbered(with(points({1}, {0, 0, 0})), 9, 1)).duplicate);
  EXPECT_TRUE(ids().empty());
}

TEST_F(SceneWriterTest, WritersNumberTheirBatchesIndependently) {
  apply(numbered(with(points({1}, {0, 0, 0})), 1, 1));
  apply(numbered(with(points({2}, {0, 0, 0})), 2, 1));
  apply(numbered(with(points({3}, {0, 0, 0})), 1, 2));
  apply(numbered(with(points({4}, {0, 0, 0})), 2, 2));
  EXPECT_EQ(ids(), (std::vector<Id>{1, 2, 3, 4}));
  expect_gap(numbered({}, 1, 4), 3);
}

TEST_F(SceneWriterTest, BatchesWithoutWriterAreAppliedEachTime) {
  EXPECT_EQ(apply(with(points({1}, {0, 0, 0}))).refused, 0u);
  EXPECT_EQ(apply(with(points({1}, {0, 0, 0}))).refused, 1u);
}

TEST_F(SceneWriterTest, AcksWithTooManyErrorsAreDroppedButBatchNumbersAreKept) {
  const std::vector<Id> unknown(limits::kMaxListedItemErrors, 5);
  const uint64_t writers = WriterTable::kMaxKeptErrors / limits::kMaxListedItemErrors + 1;
  for (uint64_t writer = 1; writer <= writers; ++writer) apply(numbered(removing(unknown), writer, 1));
  const UpdateAck first = apply(numbered(with(points({1}, {0, 0, 0})), 1, 1));
  EXPECT_TRUE(first.duplicate);
  EXPECT_EQ(first.refused, 0u);
  EXPECT_EQ(first.epoch, kEpoch);
  EXPECT_TRUE(ids().empty());
  EXPECT_EQ(apply(numbered({}, writers, 1)).errors.size(), limits::kMaxListedItemErrors);
}

TEST_F(SceneWriterTest, TheLeastRecentlyActiveWriterIsEvicted) {
  for (uint64_t writer = 1; writer <= limits::kMaxWriters; ++writer) apply(numbered({}, writer, 1));
  apply(numbered({}, 1, 2));  // makes writer 2 the least recently active writer
  apply(numbered({}, limits::kMaxWriters + 1, 1));
  expect_gap(numbered({}, 2, 2), 1);
  EXPECT_TRUE(apply(numbered({}, 1, 2)).duplicate);
  EXPECT_FALSE(apply(numbered({}, 3, 2)).duplicate);
}

}  // namespace
}  // namespace locus::test
