// Tests coalesced moves: they have the same effect as the same moves applied one batch after another.
#include "core/scene/updates/coalesced_moves.h"

#include <gtest/gtest.h>

#include "core/scene/updates/move_applier.h"
#include "tests/support/columns.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

class CoalescedMovesTest : public ::testing::Test {
 protected:
  CoalescedMovesTest() {
    for (ObjectStore* store : {&at_once_, &deferred_}) {
      for (Id id = 1; id <= 5; ++id) {
        Object object;
        object.id = id;
        store->insert(object);
      }
    }
  }

  // Applies the batch to at_once_ and adds it to the coalesced moves of deferred_. Returns whether the batch changes an
  // object, first for at_once_, then for the coalesced moves.
  std::pair<bool, bool> move(const UpdateBatch& batch) {
    moves_.run(at_once_, batch);
    const bool changes = moves_.changes();
    if (changes) at_once_.move(moves_.moves());
    moves_.run(deferred_, batch);
    return {changes, pending_.add(moves_.moves(), deferred_)};
  }

  UpdateBatch to(std::vector<Id> ids, std::vector<float> positions, std::vector<float> rotations = {}) {
    MoveColumns move;
    move.ids = columns_.ids(std::move(ids));
    move.positions = columns_.floats(std::move(positions));
    move.rotations = columns_.floats(std::move(rotations));
    UpdateBatch batch;
    batch.moves = {move};
    return batch;
  }

  using Both = std::pair<bool, bool>;
  static constexpr Both kChanges{true, true};
  static constexpr Both kNothing{false, false};

  Columns columns_;
  ObjectStore at_once_, deferred_;
  MoveApplier moves_;
  CoalescedMoves pending_;
};

TEST_F(CoalescedMovesTest, AMoveBackIsAChangeAndAMoveToTheSamePlaceIsNone) {
  EXPECT_EQ(move(to({1}, {1, 0, 0})), kChanges);
  EXPECT_EQ(move(to({1}, {1, 0, 0})), kNothing);
  EXPECT_EQ(move(to({1}, {0, 0, 0})), kChanges);
  EXPECT_EQ(move(to({1}, {0, 0, 0}, {1, 0, 0, 0})), kChanges);
  EXPECT_EQ(move(to({1}, {0, 0, 0}, {1, 0, 0, 0})), kNothing);
  EXPECT_EQ(move(to({1}, {0, 0, 0}, {0, 0, 0, 1})), kChanges);
  EXPECT_EQ(move(to({2}, {0, 0, 0}, {0, 0, 0, 1})), kNothing);
}

TEST_F(CoalescedMovesTest, RandomMovesLeaveTheSameStateAsUncoalescedMoves) {
  Random random(1);
  for (uint64_t round = 0; round < scaled_count(300); ++round) {
    for (uint64_t i = random.below(6); i > 0; --i) {
      std::vector<Id> ids(1 + random.below(3));
      std::vector<float> positions, rotations;
      const bool turns = random.chance(0.5);
      for (Id& id : ids) {
        id = 1 + random.below(6);  // id 6 is unknown
        positions.insert(positions.end(), {static_cast<float>(random.below(3)), 0, 0});
        if (turns)
          random.chance(0.5) ? rotations.insert(rotations.end(), {0, 0, 0, 1})
                             : rotations.insert(rotations.end(), {0, 1, 0, 0});
      }
      const Both changes = move(to(ids, positions, rotations));
      ASSERT_EQ(changes.first, changes.second) << round;
    }
    if (!pending_.empty()) deferred_.move(pending_.moves());
    pending_.clear();
    for (Id id = 1; id <= 5; ++id) ASSERT_EQ(deferred_.find(id), at_once_.find(id)) << round;
  }
}

}  // namespace
}  // namespace locus::test
