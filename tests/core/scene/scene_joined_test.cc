// Tests batches that are joined into one revision, compared with the same batches applied one by one.
#include <gmock/gmock.h>

#include <limits>

#include "tests/support/random.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;

class SceneJoinedTest : public SceneFixture {
 protected:
  SceneJoinedTest() { apply(with(points({1, 2, 3}, {0, 0, 0}))); }

  std::vector<UpdateAck> join(const std::vector<UpdateBatch>& batches) {
    std::vector<UpdateAck> acks;
    for (const absl::StatusOr<UpdateAck>& ack : try_to_join(batches)) {
      EXPECT_TRUE(ack.ok()) << ack.status();
      acks.push_back(ack.ok() ? *ack : UpdateAck{});
    }
    return acks;
  }

  std::vector<absl::StatusOr<UpdateAck>> try_to_join(const std::vector<UpdateBatch>& batches) {
    std::vector<const UpdateBatch*> all;
    for (const UpdateBatch& batch : batches) all.push_back(&batch);
    auto acks = scene_.apply_joined(all);
    EXPECT_TRUE(acks.ok());
    return *std::move(acks);
  }

  Vec3d position(Id id) const { return object(id)->shape.position; }
};

TEST_F(SceneJoinedTest, TheLastPositionOfAnIdWinsAndTheAcksShareOneRevision) {
  const uint64_t before = revision();
  const auto acks = join({with(move_to({1, 2}, {1, 0, 0, 1, 0, 0})), with(move_to({2, 3}, {2, 0, 0, 2, 0, 0}))});
  EXPECT_EQ(revision(), before + 1);
  EXPECT_EQ(position(1).x, 1);
  EXPECT_EQ(position(2).x, 2);
  EXPECT_EQ(position(3).x, 2);
  for (const UpdateAck& ack : acks) {
    EXPECT_EQ(ack.revision, before + 1);
    EXPECT_EQ(ack.epoch, kEpoch);
    EXPECT_EQ(ack.applied, 2u);
  }
  EXPECT_EQ(scene_.status().joined_updates, 1u);
}

TEST_F(SceneJoinedTest, AMoveWithoutRotationsKeepsTheRotationOfTheOneBefore) {
  MoveColumns turning = move_to({1}, {1, 0, 0});
  turning.rotations = columns_.floats({1, 0, 0, 0});
  join({with(turning), with(move_to({1}, {2, 0, 0}))});
  EXPECT_EQ(position(1).x, 2);
  EXPECT_EQ(object(1)->shape.rotation, (Quaternion{1, 0, 0, 0}));
}

TEST_F(SceneJoinedTest, WrongItemsAreListedInTheAckOfTheirOwnBatch) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto acks = join({with(move_to({1, 9}, {1, 0, 0, 1, 0, 0})), with(move_to({1}, {2, 0, 0})),
                          with(move_to({2, 3}, {3, 0, 0, nan, 0, 0}))});
  EXPECT_EQ(acks[0].refused, 1u);
  ASSERT_EQ(acks[0].errors.size(), 1u);
  EXPECT_EQ(acks[0].errors[0].id, 9u);
  EXPECT_EQ(acks[0].errors[0].reason, Reason::kUnknownId);
  EXPECT_EQ(acks[1].refused, 0u);
  ASSERT_EQ(acks[2].errors.size(), 1u);
  EXPECT_EQ(acks[2].errors[0].index, 1u);
  EXPECT_EQ(acks[2].errors[0].field, "moves[0].positions");
  EXPECT_EQ(position(1).x, 2);
  EXPECT_EQ(position(3).x, 0);
}

TEST_F(SceneJoinedTest, ABatchOfWrongFormIsRefusedAloneAndTheOthersAreApplied) {
  const auto acks =
      try_to_join({with(move_to({1}, {1, 0, 0})), with(move_to({2}, {1, 0})), with(move_to({3}, {1, 0, 0}))});
  EXPECT_TRUE(acks[0].ok());
  expect_refusal(acks[1].status(), absl::StatusCode::kInvalidArgument, Reason::kColumnLength, "moves[0].positions");
  EXPECT_TRUE(acks[2].ok());
  EXPECT_EQ(position(2).x, 0);
  EXPECT_EQ(position(3).x, 1);
}

TEST_F(SceneJoinedTest, SeveralBatchesOfOneWriterAreAppliedOnceEach) {
  const UpdateBatch first = numbered(with(move_to({1}, {1, 0, 0})), 5, 1);
  const UpdateBatch second = numbered(with(move_to({1}, {2, 0, 0})), 5, 2);
  const uint64_t before = revision();
  const auto acks = join({first, second, second, first});
  EXPECT_THAT((std::vector<bool>{acks[0].duplicate, acks[1].duplicate, acks[2].duplicate, acks[3].duplicate}),
              ElementsAre(false, false, true, true));
  for (const UpdateAck& ack : acks) EXPECT_EQ(ack.revision, before + 1);
  EXPECT_EQ(acks[2].applied, 1u) << "the old ack";
  EXPECT_EQ(position(1).x, 2) << "the first came again, and late";
  const UpdateAck again = apply(second);
  EXPECT_TRUE(again.duplicate);
  EXPECT_EQ(again.revision, before + 1);
  EXPECT_EQ(apply(numbered(with(move_to({1}, {3, 0, 0})), 5, 3)).revision, before + 2);
}

TEST_F(SceneJoinedTest, ADuplicateGetsItsAckAlthoughALaterBatchEvictsItsWriter) {
  for (uint64_t writer = 1; writer <= limits::kMaxWriters; ++writer)
    apply(numbered(with(move_to({1}, {0, 0, 0})), writer, 1));
  const uint64_t before = revision();
  const auto acks = join({numbered(with(move_to({1}, {0, 0, 0})), 1, 1),
                          numbered(with(move_to({2}, {1, 0, 0})), limits::kMaxWriters + 1, 1)});
  EXPECT_TRUE(acks[0].duplicate);
  EXPECT_EQ(acks[0].revision, before);
  EXPECT_EQ(acks[0].applied, 1u);
  EXPECT_EQ(acks[1].revision, before + 1);
}

TEST_F(SceneJoinedTest, ABatchWithAGapBeforeItIsRefusedAlone) {
  const auto acks = try_to_join({numbered(with(move_to({1}, {1, 0, 0})), 5, 1),
                                 numbered(with(move_to({1}, {3, 0, 0})), 5, 3), with(move_to({2}, {1, 0, 0}))});
  EXPECT_TRUE(acks[0].ok());
  expect_refusal(acks[1].status(), absl::StatusCode::kFailedPrecondition, Reason::kBatchGap, "batch");
  EXPECT_TRUE(acks[2].ok());
  EXPECT_EQ(position(1).x, 1);
}

TEST_F(SceneJoinedTest, MovesThatChangeNothingMakeNoRevision) {
  const uint64_t before = revision();
  const auto acks = join({with(move_to({1}, {0, 0, 0})), with(move_to({2}, {0, 0, 0}))});
  EXPECT_EQ(revision(), before);
  EXPECT_EQ(acks[1].revision, before);
}

TEST_F(SceneJoinedTest, TheTickOfJoinedBatchesBecomesTheSceneTick) {
  std::vector<UpdateBatch> batches = {with(move_to({1}, {1, 0, 0})), with(move_to({2}, {1, 0, 0}))};
  for (UpdateBatch& batch : batches) batch.tick = 7;
  EXPECT_EQ(join(batches)[0].tick, 7u);
  EXPECT_EQ(scene_.latest()->tick, 7u);
}

TEST_F(SceneJoinedTest, OnlyMovesOfOneTickItemByItemMayJoin) {
  const UpdateBatch moves = with(move_to({1}, {1, 0, 0}));
  EXPECT_TRUE(may_join(moves, moves));
  UpdateBatch other = moves;
  other.tick = 1;
  EXPECT_FALSE(may_join(moves, other));
  EXPECT_TRUE(may_join(other, other));
  other = moves;
  other.all_or_nothing = true;
  EXPECT_FALSE(may_join(moves, other));
  other = moves;
  other.clear = true;
  EXPECT_FALSE(may_join(other, moves));
  other = moves;
  other.moves[0].teleport = true;
  EXPECT_FALSE(may_join(moves, other));
  other = moves;
  other.remove_ids = columns_.ids({3});
  EXPECT_FALSE(may_join(moves, other));
  EXPECT_FALSE(may_join(moves, with(points({4}, {0, 0, 0}))));
  EXPECT_FALSE(may_join(moves, UpdateBatch())) << "nothing to move";
}

TEST_F(SceneJoinedTest, AClosedSceneRefusesAll) {
  scene_.close();
  const UpdateBatch batch = with(move_to({1}, {1, 0, 0}));
  EXPECT_EQ(scene_.apply_joined(std::vector<const UpdateBatch*>{&batch, &batch}).status().code(),
            absl::StatusCode::kNotFound);
}

// The batches are random moves of known and unknown objects, with and without rotations and writer ids.
TEST_F(SceneJoinedTest, JoinedBatchesLeaveTheSameStateAsTheBatchesOneByOne) {
  Random random(6);
  Scene alone("alone", SceneSpec(), kEpoch, StaticSet::empty());
  UpdateBatch insert;
  std::vector<Id> known;
  for (Id id = 10; id < 60; ++id) known.push_back(id);
  insert.inserts.push_back(points(known, {0, 0, 0}));
  apply(insert);
  ASSERT_TRUE(alone.apply(insert).ok());
  uint64_t sent = 0;
  for (int round = 0; round < 50; ++round) {
    std::vector<UpdateBatch> batches;
    for (size_t i = 0; i < 1 + random.below(6); ++i) {
      std::vector<Id> ids;
      std::vector<float> positions, rotations;
      for (size_t n = 0; n < 1 + random.below(30); ++n) {
        ids.push_back(8 + random.below(55));
        for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(random.below(5)));
        rotations.insert(rotations.end(), {random.chance(0.5) ? 1.0f : 0.0f, 0, 0, 0});
        rotations.back() = rotations[rotations.size() - 4] == 0 ? 1.0f : 0.0f;
      }
      MoveColumns move = move_to(ids, positions);
      if (random.chance(0.5)) move.rotations = columns_.floats(rotations);
      batches.push_back(with(move));
      if (random.chance(0.5)) batches.back() = numbered(batches.back(), 9, ++sent);
    }
    const std::vector<UpdateAck> acks = join(batches);
    for (size_t i = 0; i < batches.size(); ++i) {
      const auto expected = alone.apply(batches[i]);
      ASSERT_TRUE(expected.ok());
      EXPECT_EQ(acks[i].applied, expected->applied);
      EXPECT_EQ(acks[i].refused, expected->refused);
      EXPECT_EQ(acks[i].errors.size(), expected->errors.size());
    }
    for (const Id id : known) ASSERT_EQ(object(id), alone.latest()->objects.find(id)) << round << ' ' << id;
  }
}

}  // namespace
}  // namespace locus::test
