// Tests what ends the existence of objects without a remove: expiry ticks and leases. Also tests batches of several
// messages, which become one revision.
#include <gmock/gmock.h>

#include "core/base/limits.h"
#include "core/scene/scene.h"
#include "core/scene/snapshot/scene_at_time.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

SceneSpec with_history() {
  SceneSpec spec;
  spec.history = {100, uint64_t{1} << 30};
  return spec;
}

class SceneLifetimesTest : public SceneFixture {
 protected:
  explicit SceneLifetimesTest(const SceneSpec& spec = SceneSpec()) : SceneFixture(spec) {}

  UpdateBatch inserting(std::vector<Id> ids, std::vector<uint64_t> expire_ticks = {}) {
    UpdateBatch batch = with(points(std::move(ids), {0, 0, 0}));
    batch.inserts[0].expire_ticks = columns_.ids(std::move(expire_ticks));
    return batch;
  }
  static UpdateBatch at(uint64_t tick, UpdateBatch batch = {}) {
    batch.tick = tick;
    return batch;
  }
  static UpdateBatch upserting(UpdateBatch batch) {
    batch.upsert = true;
    return batch;
  }
  static UpdateBatch leased(uint32_t lease_ms, UpdateBatch batch) {
    batch.lease_ms = lease_ms;
    return batch;
  }
  static UpdateBatch group(std::vector<UpdateBatch> earlier, UpdateBatch last) {
    last.earlier = std::move(earlier);
    return last;
  }
  uint64_t remaining(Id id) const {
    const SnapshotPtr snapshot = scene_.latest();
    return snapshot->remaining_ticks(snapshot->objects.find_ref(id).handle());
  }
  bool end_lease(uint64_t writer) {
    return scene_.end_lease(writer, [] { return true; })->has_value();
  }
};

class SceneHistoryLifetimesTest : public SceneLifetimesTest {
 protected:
  SceneHistoryLifetimesTest() : SceneLifetimesTest(with_history()) {}

  bool is_at(Id id, uint64_t tick, float fraction) const {
    const std::optional<SceneAtTime> then = find_scene_at(*scene_.latest(), {tick, fraction});
    return then && then->objects().find_ref(id);
  }
};

TEST_F(SceneLifetimesTest, AnObjectExpiresWithTheFirstBatchAtItsTick) {
  apply(at(10, inserting({1, 2, 3}, {3, 5, 0})));
  apply(at(12));
  EXPECT_THAT(ids(), ElementsAre(1, 2, 3));
  EXPECT_EQ(remaining(1), 1u);
  EXPECT_EQ(remaining(3), 0u);
  const uint64_t before = revision();
  const UpdateAck ack = apply(at(13));
  EXPECT_EQ(ack.applied + ack.refused, 0u);
  EXPECT_EQ(ack.revision, before + 1);
  EXPECT_THAT(ids(), ElementsAre(2, 3));
  apply(at(1000));
  EXPECT_THAT(ids(), ElementsAre(3));
}

TEST_F(SceneLifetimesTest, AnExpiredObjectIsGoneBeforeTheItemsOfTheBatch) {
  apply(at(1, inserting({1, 2, 3}, {1})));
  UpdateBatch batch = at(2, inserting({1}));
  batch.moves = {move_to({2}, {5, 5, 5})};
  batch.remove_ids = columns_.ids({3});
  const UpdateAck ack = apply(batch);
  EXPECT_EQ(ack.applied, 1u);
  ASSERT_EQ(ack.errors.size(), 2u);
  EXPECT_EQ(ack.errors[0].field, "remove_ids");
  EXPECT_EQ(ack.errors[1].field, "moves[0].ids");
  EXPECT_THAT(ids(), ElementsAre(1));
  EXPECT_EQ(remaining(1), 0u);
}

TEST_F(SceneLifetimesTest, AnObjectMayBeInsertedAgainByTheBatchWithWhichItExpiresAtAnyTick) {
  constexpr uint64_t kFar = uint64_t{1} << 62;
  apply(at(0, inserting({1}, {10})));
  for (const uint64_t tick : {kFar - 10, kFar, kFar + 10, 2 * kFar}) {
    apply(at(tick, inserting({1}, {10})));
    EXPECT_THAT(ids(), ElementsAre(1));
    EXPECT_EQ(remaining(1), 10u);
    apply(at(tick + 9, {}));
    EXPECT_EQ(remaining(1), 1u);
  }
  const uint64_t before = revision();
  apply(at(2 * kFar + 10, inserting({1})));
  EXPECT_EQ(revision(), before + 1);
  EXPECT_EQ(remaining(1), 0u);
  apply(at(3 * kFar, {}));
  EXPECT_THAT(ids(), ElementsAre(1));
}

TEST_F(SceneLifetimesTest, ABatchOfMovesExpiresObjects) {
  apply(at(1, inserting({1, 2}, {4, 0})));
  const UpdateAck ack = apply(at(5, with(move_to({1, 2}, {1, 1, 1, 2, 2, 2}))));
  EXPECT_EQ(ack.applied, 1u);
  EXPECT_EQ(ack.refused, 1u);
  EXPECT_THAT(ids(), ElementsAre(2));
}

TEST_F(SceneLifetimesTest, JoinedMovesExpireObjects) {
  apply(at(1, inserting({1, 2}, {4, 0})));
  const UpdateBatch first = at(5, with(move_to({1}, {1, 1, 1}))), second = at(5, with(move_to({2}, {2, 2, 2})));
  const UpdateBatch* const batches[] = {&first, &second};
  const auto acks = scene_.apply_joined(batches);
  ASSERT_TRUE(acks.ok());
  EXPECT_EQ((*acks)[0]->refused, 1u);
  EXPECT_EQ((*acks)[1]->applied, 1u);
  EXPECT_EQ((*acks)[1]->revision, 2u);
  EXPECT_THAT(ids(), ElementsAre(2));
  EXPECT_EQ(object(2)->shape.position, (Vec3d{2, 2, 2}));
}

TEST_F(SceneLifetimesTest, JoinedMovesDoNotMoveTheObjectThatExpiresAlthoughItWasMovedBefore) {
  apply(at(1, inserting({1, 2}, {4, 0})));
  apply(at(2, with(move_to({1, 2}, {1, 1, 1, 2, 2, 2}))));
  const UpdateBatch first = at(5, with(move_to({1, 2}, {3, 3, 3, 4, 4, 4}))), second = first;
  const UpdateBatch* const batches[] = {&first, &second};
  const auto acks = scene_.apply_joined(batches);
  ASSERT_TRUE(acks.ok());
  for (const absl::StatusOr<UpdateAck>& ack : *acks) {
    ASSERT_TRUE(ack.ok());
    EXPECT_EQ(ack->applied, 1u);
    EXPECT_EQ(ack->refused, 1u);
  }
  EXPECT_FALSE(object(1).has_value());
  EXPECT_EQ(object(2)->shape.position, (Vec3d{4, 4, 4}));
}

TEST_F(SceneLifetimesTest, ARefusedBatchExpiresNothing) {
  apply(at(1, inserting({1}, {1})));
  UpdateBatch batch = at(9, removing({77}));
  batch.all_or_nothing = true;
  EXPECT_FALSE(scene_.apply(batch).ok());
  EXPECT_THAT(ids(), ElementsAre(1));
  EXPECT_EQ(revision(), 1u);
}

TEST_F(SceneLifetimesTest, ADuplicateExpiresNothing) {
  apply(numbered(at(1, inserting({1}, {5})), 7, 1));
  EXPECT_TRUE(apply(numbered(at(99), 7, 1)).duplicate);
  EXPECT_THAT(ids(), ElementsAre(1));
}

TEST_F(SceneLifetimesTest, AnUpsertReplacesTheExpiry) {
  apply(at(1, inserting({1, 2, 3}, {5})));
  apply(at(2, upserting(inserting({1, 2}, {10, 0}))));
  EXPECT_EQ(remaining(1), 10u);
  EXPECT_EQ(remaining(2), 0u);
  EXPECT_EQ(remaining(3), 4u);
  const uint64_t before = revision();
  apply(upserting(inserting({3}, {9})));  // changes nothing else
  EXPECT_EQ(revision(), before + 1);
  apply(upserting(inserting({3}, {9})));
  EXPECT_EQ(revision(), before + 1);
  apply(at(11));
  EXPECT_THAT(ids(), ElementsAre(1, 2));
}

TEST_F(SceneLifetimesTest, MovesAndRelabelsKeepTheExpiry) {
  apply(at(1, inserting({1}, {5})));
  UpdateBatch batch = with(move_to({1}, {9, 9, 9}));
  batch.moves[0].teleport = true;
  batch.relabels.emplace_back().ids = columns_.ids({1});
  batch.relabels[0].tags = columns_.ids({4});
  apply(batch);
  EXPECT_EQ(remaining(1), 5u);
}

TEST_F(SceneLifetimesTest, ARemovedObjectThatIsInsertedAgainHasItsNewExpiryOnly) {
  apply(at(1, inserting({1, 2}, {5})));
  UpdateBatch batch = inserting({1});
  batch.remove_ids = columns_.ids({1});
  apply(batch);
  apply(removing({2}));
  apply(inserting({2}, {50}));
  apply(at(40));
  EXPECT_THAT(ids(), ElementsAre(1, 2));
  UpdateBatch cleared = inserting({2}, {3});
  cleared.clear = true;
  apply(cleared);
  EXPECT_EQ(remaining(2), 3u);
}

TEST_F(SceneLifetimesTest, RestartedTicksKeepTheRemainingTicks) {
  apply(at(100, inserting({1}, {10})));
  apply(at(104));
  UpdateBatch restart = at(2, inserting({2}, {3}));
  restart.restart_ticks = true;
  apply(restart);
  EXPECT_EQ(remaining(1), 6u);
  EXPECT_EQ(remaining(2), 3u);
  apply(at(7));
  EXPECT_THAT(ids(), ElementsAre(1));
  restart = at(5000);
  restart.restart_ticks = true;
  apply(restart);
  EXPECT_THAT(ids(), ElementsAre(1));
  apply(at(5001));
  EXPECT_THAT(ids(), IsEmpty());
}

TEST_F(SceneLifetimesTest, ExpireTicksOutOfRangeRefuseTheItem) {
  const UpdateAck ack = apply(inserting({1, 2}, {limits::kMaxExpireTicks + 1, limits::kMaxExpireTicks}));
  EXPECT_EQ(ack.applied, 1u);
  ASSERT_EQ(ack.errors.size(), 1u);
  EXPECT_EQ(ack.errors[0].field, "inserts[0].expire_ticks");
  EXPECT_EQ(ack.errors[0].index, 0u);
  EXPECT_EQ(ack.errors[0].reason, Reason::kOutOfRange);
  EXPECT_EQ(remaining(2), limits::kMaxExpireTicks);
}

TEST_F(SceneLifetimesTest, ExpiredObjectsMakeRoomWithinTheBatchAndAreNoLongerCounted) {
  const auto count = std::make_shared<std::atomic<uint64_t>>(0);
  scene_.count_objects_in(count);
  apply(at(1, inserting({1, 2, 3}, {1})));
  EXPECT_EQ(count->load(), 3u);
  apply(at(2, inserting({4})));
  EXPECT_EQ(count->load(), 1u);
}

TEST_F(SceneLifetimesTest, TheBytesOfExpiriesAreCounted) {
  apply(inserting({1}));
  const uint64_t before = scene_.status().memory_bytes;
  apply(upserting(inserting({1}, {5})));
  EXPECT_GT(scene_.status().memory_bytes, before);
}

TEST_F(SceneHistoryLifetimesTest, AnObjectIsThereAtTicksBeforeItsExpiryAndNeverLater) {
  apply(at(10, inserting({1, 2}, {3, 0})));
  for (uint64_t tick = 11; tick <= 16; ++tick) apply(at(tick, with(move_to({2}, {static_cast<float>(tick), 0, 0}))));
  for (uint64_t tick = 10; tick <= 15; ++tick)
    for (const float fraction : {0.f, 0.5f, 0.99f}) EXPECT_EQ(is_at(1, tick, fraction), tick < 13) << tick;
  EXPECT_FALSE(is_at(1, 16, 0));
}

TEST_F(SceneHistoryLifetimesTest, ATeleportKeepsTheExpiryAndTheLease) {
  apply(numbered(leased(5, at(1, inserting({1, 2}, {9}))), 7, 1));
  UpdateBatch batch = at(2, with(move_to({1}, {9, 9, 9})));
  batch.moves[0].teleport = true;
  apply(batch);
  EXPECT_EQ(remaining(1), 8u);
  EXPECT_TRUE(end_lease(7));
  EXPECT_THAT(ids(), IsEmpty());
}

TEST_F(SceneHistoryLifetimesTest, EndedLeasesLeaveThePastAsItWas) {
  apply(numbered(leased(5, at(1, inserting({1}))), 7, 1));
  apply(at(3));
  EXPECT_TRUE(end_lease(7));
  EXPECT_TRUE(is_at(1, 1, 0));
  EXPECT_TRUE(is_at(1, 2, 0.5f));
  EXPECT_FALSE(is_at(1, 3, 0));
}

TEST_F(SceneLifetimesTest, AnEndedLeaseRemovesExactlyItsObjectsAsOneRevision) {
  apply(numbered(inserting({1}), 7, 1));  // before the lease
  apply(numbered(leased(100, inserting({2, 3})), 7, 2));
  apply(numbered(inserting({4}), 7, 3));               // a later batch without lease_ms
  apply(numbered(leased(100, inserting({5})), 8, 1));  // another writer
  apply(inserting({6}));
  EXPECT_THAT(*scene_.leases(), ElementsAre(Lease{7, 100}, Lease{8, 100}));
  const uint64_t before = revision();
  EXPECT_TRUE(end_lease(7));
  EXPECT_EQ(revision(), before + 1);
  EXPECT_THAT(ids(), ElementsAre(1, 5, 6));
  EXPECT_THAT(*scene_.leases(), ElementsAre(Lease{8, 100}));
}

TEST_F(SceneLifetimesTest, ALeaseEndsOnlyOnce) {
  apply(numbered(leased(100, inserting({1})), 7, 1));
  EXPECT_TRUE(end_lease(7));
  const uint64_t before = revision();
  apply(numbered(inserting({1}), 7, 2));  // the ended lease does not begin again by itself
  EXPECT_FALSE(end_lease(7));
  EXPECT_THAT(ids(), ElementsAre(1));
  EXPECT_EQ(revision(), before + 1);
  apply(numbered(leased(50, upserting(inserting({1}))), 7, 3));
  EXPECT_TRUE(end_lease(7));
  EXPECT_THAT(ids(), IsEmpty());
}

TEST_F(SceneLifetimesTest, ALeaseThatIsNotDueStays) {
  apply(numbered(leased(100, inserting({1})), 7, 1));
  EXPECT_EQ(*scene_.end_lease(7, [] { return false; }), std::nullopt);
  EXPECT_THAT(ids(), ElementsAre(1));
  EXPECT_THAT(*scene_.leases(), ElementsAre(Lease{7, 100}));
}

TEST_F(SceneLifetimesTest, AnObjectThatAnotherWriterInsertsAgainLeavesTheLease) {
  apply(numbered(leased(100, inserting({1, 2, 3, 4})), 7, 1));
  apply(upserting(inserting({1})));
  apply(numbered(leased(9, upserting(inserting({2}))), 8, 1));
  UpdateBatch again = inserting({3});
  again.remove_ids = columns_.ids({3});
  apply(again);
  apply(with(move_to({4}, {5, 5, 5})));  // a move by another writer is no insertion
  EXPECT_TRUE(end_lease(7));
  EXPECT_THAT(ids(), ElementsAre(1, 2, 3));
  EXPECT_TRUE(end_lease(8));
  EXPECT_THAT(ids(), ElementsAre(1, 3));
}

TEST_F(SceneLifetimesTest, ALeaseWithoutObjectsMakesNoRevision) {
  apply(numbered(leased(100, UpdateBatch()), 7, 1));
  EXPECT_EQ(revision(), 0u);
  EXPECT_THAT(*scene_.leases(), ElementsAre(Lease{7, 100}));
  apply(numbered(leased(20, UpdateBatch()), 7, 2));
  EXPECT_THAT(*scene_.leases(), ElementsAre(Lease{7, 20}));
  EXPECT_TRUE(end_lease(7));
  EXPECT_EQ(revision(), 0u);
}

TEST_F(SceneLifetimesTest, ARefusedBatchBeginsNoLease) {
  UpdateBatch batch = numbered(leased(100, removing({1})), 7, 1);
  batch.all_or_nothing = true;
  EXPECT_FALSE(scene_.apply(batch).ok());
  EXPECT_THAT(*scene_.leases(), IsEmpty());
}

TEST_F(SceneLifetimesTest, TooManyLeasesAreRefusedAndChangeNothing) {
  for (uint64_t writer = 1; writer <= limits::kMaxLeases; ++writer)
    apply(numbered(leased(1, UpdateBatch()), writer, 1));
  const absl::StatusOr<UpdateAck> ack = scene_.apply(numbered(leased(1, inserting({1})), limits::kMaxLeases + 1, 1));
  EXPECT_EQ(ack.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal_of(ack.status())->limit, "leases");
  EXPECT_THAT(ids(), IsEmpty());
}

TEST_F(SceneLifetimesTest, MessagesOfOneBatchAreOneRevisionAppliedInOrder) {
  UpdateBatch removes = removing({1});
  removes.frame = {1, 0, 0};
  const UpdateAck ack = apply(
      group({inserting({1, 2}), with(move_to({2}, {4, 4, 4})), removes}, at(9, with(move_to({1, 2}, {7, 7, 7})))));
  EXPECT_EQ(ack.revision, 1u);
  EXPECT_EQ(ack.tick, 9u);
  EXPECT_EQ(ack.applied, 5u);
  EXPECT_EQ(ack.refused, 1u);
  ASSERT_EQ(ack.errors.size(), 1u);
  EXPECT_EQ(ack.errors[0].message, 3u);
  EXPECT_EQ(ack.errors[0].field, "moves[0].ids");
  EXPECT_THAT(ids(), ElementsAre(2));
  EXPECT_EQ(object(2)->shape.position, (Vec3d{7, 7, 7}));
}

TEST_F(SceneLifetimesTest, ErrorsOfMessagesAreInOrderOfApplication) {
  UpdateBatch first = removing({1});
  first.instance_moves = {instances_to({5}, {0, 0, 0})};
  const UpdateAck ack = apply(group({first}, removing({2})));
  ASSERT_EQ(ack.errors.size(), 3u);
  EXPECT_EQ(ack.errors[0].field, "remove_ids");
  EXPECT_EQ(ack.errors[1].field, "instance_moves[0].ids");
  EXPECT_EQ(ack.errors[1].message, 0u);
  EXPECT_EQ(ack.errors[2].message, 1u);
}

TEST_F(SceneLifetimesTest, ARefusedItemOfAnyMessageRefusesAllIfTheLastSaysSo) {
  UpdateBatch batch = group({inserting({1}), removing({9})}, inserting({2}));
  batch.all_or_nothing = true;
  const absl::Status status = scene_.apply(batch).status();
  expect_refusal(status, absl::StatusCode::kInvalidArgument, Reason::kUnknownId, "remove_ids", 0);
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("id 9 in message 1"));
  EXPECT_EQ(revision(), 0u);
  EXPECT_THAT(ids(), IsEmpty());
}

TEST_F(SceneLifetimesTest, ClearAndRemovedGroupsOfALaterMessageConcernEarlierInserts) {
  apply(inserting({1}));
  UpdateBatch grouped = inserting({2, 3});
  grouped.inserts[0].groups = columns_.ids({8, 9});
  UpdateBatch regrouped;
  regrouped.relabels.emplace_back().ids = columns_.ids({1});
  regrouped.relabels[0].groups = columns_.ids({8});
  UpdateBatch removes;
  removes.remove_groups = columns_.ids({8});
  apply(group({grouped, regrouped}, removes));
  EXPECT_THAT(ids(), ElementsAre(3));
  UpdateBatch clears = inserting({5});
  clears.clear = true;
  apply(group({inserting({4})}, clears));
  EXPECT_THAT(ids(), ElementsAre(5));
}

TEST_F(SceneLifetimesTest, InstancesMoveInSeveralMessages) {
  ASSERT_TRUE(scene_.change_instances(placing(placement({50}, {0, 0, 0}))).ok());
  const uint64_t before = revision();
  InstanceMoveColumns scaled = instances_to({50}, {2, 0, 0});
  scaled.scales = columns_.floats({3});
  apply(group({with(scaled)}, with(instances_to({50}, {4, 0, 0}))));
  EXPECT_EQ(revision(), before + 1);
  const Transform& transform = scene_.latest()->statics->find(50)->transform;
  EXPECT_EQ(transform.translation, (Vec3d{4, 0, 0}));
  EXPECT_EQ(transform.scale, 3);
}

TEST_F(SceneLifetimesTest, ExpiryAndLeaseOfEarlierMessagesAreThoseOfTheLast) {
  apply(at(5, inserting({1}, {2})));
  apply(group({inserting({1, 2}, {3})}, numbered(leased(50, at(7, inserting({3}, {4}))), 7, 1)));
  EXPECT_THAT(ids(), ElementsAre(1, 2, 3));  // the old object 1 expired before the first message
  EXPECT_EQ(remaining(1), 3u);
  EXPECT_EQ(remaining(3), 4u);
  EXPECT_TRUE(end_lease(7));
  EXPECT_THAT(ids(), IsEmpty());
}

TEST_F(SceneLifetimesTest, SeveralMessagesThatWereAppliedAreADuplicate) {
  const UpdateBatch batch = group({inserting({1, 1})}, numbered(removing({9}), 7, 1));
  const UpdateAck first = apply(batch), second = apply(batch);
  EXPECT_TRUE(second.duplicate);
  EXPECT_EQ(second.applied, first.applied);
  ASSERT_EQ(second.errors.size(), 2u);
  EXPECT_EQ(second.errors[1].message, 1u);
}

}  // namespace
}  // namespace locus::test
