// Tests MoveApplier, the fast path for batches of moves: its effects and acks equal those of BatchApplier.
#include "core/scene/updates/move_applier.h"

#include "tests/support/random.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/special_floats.h"

namespace locus::test {
namespace {

class MoveApplierTest : public SceneFixture {
 protected:
  void SetUp() override { apply(with(points({1, 2, 3}, {1, 1, 1, 2, 2, 2, 3, 3, 3}))); }
};

std::string ack_text(const UpdateAck& ack) {
  std::string text = std::to_string(ack.applied) + " applied, " + std::to_string(ack.refused) + " refused";
  for (const ItemError& error : ack.errors)
    text += "; " + error.field + " " + std::to_string(error.index) + " " + std::to_string(error.id) + " " +
            std::to_string(static_cast<int>(error.reason));
  return text;
}

TEST_F(MoveApplierTest, ServesOnlyBatchesOfMoves) {
  EXPECT_TRUE(MoveApplier::serves(with(move_to({1}, {0, 0, 0}))));
  EXPECT_FALSE(MoveApplier::serves(UpdateBatch()));
  UpdateBatch both = with(move_to({1}, {0, 0, 0}));
  both.relabels.emplace_back();
  EXPECT_FALSE(MoveApplier::serves(both));
}

TEST_F(MoveApplierTest, TheLastOfSeveralMovesOfOneObjectWinsAndAllAreCountedAsApplied) {
  const UpdateAck ack = apply(with(move_to({1, 2, 1}, {5, 5, 5, 6, 6, 6, 7, 7, 7})));
  EXPECT_EQ(ack.applied, 3u);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{7, 7, 7}));
  EXPECT_EQ(object(2)->shape.position, (Vec3d{6, 6, 6}));
}

TEST_F(MoveApplierTest, AMoveThereAndBackMakesNoRevision) {
  const uint64_t before = revision();
  EXPECT_EQ(apply(with(move_to({1, 1}, {5, 5, 5, 1, 1, 1}))).revision, before);
}

TEST_F(MoveApplierTest, ARotationAloneIsAChangeAndLaterMovesKeepIt) {
  MoveColumns turn = move_to({2}, {2, 2, 2});
  turn.rotations = columns_.floats({0, 0, 1, 0});
  const uint64_t before = revision();
  EXPECT_EQ(apply(with(turn)).revision, before + 1);
  EXPECT_EQ(apply(with(turn)).revision, before + 1);
  apply(with(move_to({2}, {4, 4, 4})));
  EXPECT_EQ(object(2)->shape.rotation, (Quaternion{0, 0, 1, 0}));
  EXPECT_EQ(object(2)->shape.position, (Vec3d{4, 4, 4}));
}

TEST_F(MoveApplierTest, AllOrNothingRefusesTheBatchAndChangesNothing) {
  UpdateBatch batch = with(move_to({1, 99}, {5, 5, 5, 6, 6, 6}));
  batch.all_or_nothing = true;
  const uint64_t before = revision();
  expect_refusal(scene_.apply(batch).status(), absl::StatusCode::kInvalidArgument, Reason::kUnknownId, "moves[0].ids",
                 1);
  EXPECT_EQ(revision(), before);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{1, 1, 1}));
}

TEST_F(MoveApplierTest, GivesTheSameResultAsBatchApplier) {
  Random random(5);
  Scene other("other", {}, kEpoch, StaticSet::empty());
  ASSERT_TRUE(other.apply(with(points({1, 2, 3}, {1, 1, 1, 2, 2, 2, 3, 3, 3}))).ok());
  for (int round = 0; round < 500; ++round) {
    Columns columns;
    UpdateBatch batch;
    for (uint64_t list = 0; list <= random.below(2); ++list) {
      std::vector<Id> ids;
      std::vector<float> positions, rotations;
      for (uint64_t i = 0; i <= random.below(5); ++i) {
        ids.push_back(random.below(5));
        for (int axis = 0; axis < 3; ++axis)
          positions.push_back(random.chance(0.03) ? kNan : random.chance(0.03) ? 2e9f : random.float_between(-4, 4));
        for (const float part : {0.0f, 0.0f, random.chance(0.1) ? 3.0f : 1.0f, 0.0f}) rotations.push_back(part);
      }
      MoveColumns move;
      move.ids = columns.ids(ids);
      move.positions = columns.floats(positions);
      if (random.chance(0.3)) move.rotations = columns.floats(rotations);
      batch.moves.push_back(move);
    }
    const absl::StatusOr<UpdateAck> fast = scene_.apply(batch);
    batch.relabels.emplace_back();  // an empty list, so that BatchApplier applies the batch
    const absl::StatusOr<UpdateAck> general = other.apply(batch);
    ASSERT_TRUE(fast.ok() && general.ok());
    ASSERT_EQ(ack_text(*fast), ack_text(*general)) << "seed 5, round " << round;
    ASSERT_EQ(fast->revision, general->revision) << "seed 5, round " << round;
    for (const Id id : {1, 2, 3}) ASSERT_EQ(object(id), other.latest()->objects.find(id));
  }
}

TEST_F(MoveApplierTest, MovesTheObjectThatHasTheIdNowWhenABatchIsRepeated) {
  const auto put_back = [&](Id id, float at) {
    UpdateBatch batch = with(points({id}, {at, at, at}));
    batch.remove_ids = columns_.ids({id});
    return batch;
  };
  for (int round = 0; round < 3; ++round) {
    const auto at = static_cast<float>(10 * round);
    apply(with(move_to({1, 2, 3}, {at, 0, 0, at + 1, 0, 0, at + 2, 0, 0})));
    for (const Id id : {1, 2, 3}) EXPECT_EQ(object(id)->shape.position.x, at + static_cast<float>(id - 1));
    // Objects 1 and 3 get each other's place in memory, and another object gets that of 2.
    UpdateBatch leave;
    leave.remove_ids = columns_.ids({3, 2, 1});
    apply(leave);
    const UpdateAck gone = apply(with(move_to({1, 2, 3}, {5, 5, 5, 5, 5, 5, 5, 5, 5})));
    EXPECT_EQ(gone.refused, 3u);
    apply(with(points({3, 77, 1}, {0, 0, 0, 0, 0, 0, 0, 0, 0})));
    const UpdateAck one_gone = apply(with(move_to({1, 2, 3}, {7, 0, 0, 8, 0, 0, 9, 0, 0})));
    EXPECT_EQ(one_gone.refused, 1u);
    EXPECT_EQ(object(1)->shape.position.x, 7);
    EXPECT_EQ(object(3)->shape.position.x, 9);
    EXPECT_EQ(object(77)->shape.position.x, 0);
    apply(put_back(1, 1));
    UpdateBatch again = with(points({2}, {2, 2, 2}));
    again.remove_ids = columns_.ids({77});
    apply(again);
  }
}

}  // namespace
}  // namespace locus::test
