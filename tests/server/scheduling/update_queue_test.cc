#include "server/scheduling/update_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "core/base/refusal.h"
#include "core/scene/registry.h"
#include "tests/support/memory_log.h"
#include "tests/support/scene_fixture.h"

namespace locus::server {
namespace {

using testing::Each;

constexpr Scene::Deadline kNow = Scene::Deadline::min();

ScenePtr make_scene(OverloadPolicy overload = OverloadPolicy::kEveryBatch, uint64_t pinned_bytes = 0) {
  SceneSpec spec;
  spec.overload = overload;
  spec.pinned_bytes = pinned_bytes;
  return std::make_shared<Scene>("scene", spec, 1, StaticSet::empty());
}

// Batch that moves or inserts points. It owns its columns.
class Points final : public PendingUpdate {
 public:
  enum class Kind : uint8_t { kInsert, kMove };

  Points(Kind kind, std::vector<uint64_t> ids, float x) : ids_(std::move(ids)) {
    for (size_t i = 0; i < ids_.size(); ++i) positions_.insert(positions_.end(), {x, 0, 0});
    if (kind == Kind::kInsert) {
      batch_.inserts.emplace_back();
      batch_.inserts[0].ids = ids_;
      batch_.inserts[0].positions = positions_;
    } else {
      batch_.moves.emplace_back();
      batch_.moves[0].ids = ids_;
      batch_.moves[0].positions = positions_;
    }
  }

  const UpdateBatch& batch() const override { return batch_; }
  absl::Status stop() const override {
    checked_ = true;
    while (held_) std::this_thread::yield();
    return stopped_ ? absl::CancelledError("gone") : absl::OkStatus();
  }
  void done(absl::StatusOr<UpdateAck> ack) override {
    ack_ = std::move(ack);
    done_ = true;
  }

  UpdateBatch& change() { return batch_; }
  void hold() { held_ = true; }
  void release() { held_ = false; }
  void cancel() { stopped_ = true; }
  bool is_done() const { return done_; }
  void wait_until_checked() const {
    while (!checked_) std::this_thread::yield();
  }
  const absl::StatusOr<UpdateAck>& wait() const {
    while (!done_) std::this_thread::yield();
    return ack_;
  }

 private:
  std::vector<uint64_t> ids_;
  std::vector<float> positions_;
  UpdateBatch batch_;
  std::atomic<bool> held_{false}, stopped_{false}, done_{false};
  mutable std::atomic<bool> checked_{false};
  absl::StatusOr<UpdateAck> ack_;
};

std::unique_ptr<Points> insert(std::vector<uint64_t> ids) {
  return std::make_unique<Points>(Points::Kind::kInsert, std::move(ids), 0);
}
std::unique_ptr<Points> move(std::vector<uint64_t> ids, float x) {
  return std::make_unique<Points>(Points::Kind::kMove, std::move(ids), x);
}

// Fixture with a scene that has the points 1 to 3.
class UpdateQueueTest : public testing::Test {
 protected:
  explicit UpdateQueueTest(OverloadPolicy overload = OverloadPolicy::kEveryBatch) : scene_(make_scene(overload)) {
    UpdateBatch batch;
    const std::vector<uint64_t> ids = {1, 2, 3};
    const std::vector<float> positions(3, 0.0f);
    batch.inserts.emplace_back();
    batch.inserts[0].ids = ids;
    batch.inserts[0].positions = positions;
    EXPECT_TRUE(scene_->apply(batch).ok());
  }

  // Returns options with which `threads` threads of the queue apply every batch: post() applies none itself.
  static UpdateQueueOptions without_inline(uint32_t threads = 1) {
    UpdateQueueOptions options;
    options.threads = threads;
    options.inline_nanoseconds = 0;
    return options;
  }

  // Posts a batch that keeps one thread of the queue busy until the batch's release().
  std::unique_ptr<Points> occupy(UpdateQueue& queue) {
    auto held = move({1}, -1);
    held->hold();
    EXPECT_TRUE(queue.post(scene_, *held, WhenFull::kRefuse).ok());
    held->wait_until_checked();
    return held;
  }

  double x_of(Id id) const { return scene_->latest()->objects.find(id)->shape.position.x; }

  ScenePtr scene_;
};

class LatestWinsTest : public UpdateQueueTest {
 protected:
  LatestWinsTest() : UpdateQueueTest(OverloadPolicy::kLatestWins) {}
};

TEST_F(UpdateQueueTest, ASmallBatchForAnIdleSceneIsAppliedByItsCaller) {
  UpdateQueue queue({});
  const auto update = move({1}, 5);
  EXPECT_EQ(*queue.post(scene_, *update, WhenFull::kRefuse), Posted::kTaken);
  ASSERT_TRUE(update->is_done());
  EXPECT_EQ(update->wait()->applied, 1u);
  EXPECT_EQ(x_of(1), 5);
  EXPECT_EQ(queue.stats().applied_inline, 1u);
}

TEST_F(UpdateQueueTest, ABatchThatScansEveryObjectIsNotAppliedByItsCaller) {
  UpdateQueue queue({});
  const auto update = insert({7});
  update->change().clear = true;
  ASSERT_TRUE(queue.post(scene_, *update, WhenFull::kRefuse).ok());
  EXPECT_TRUE(update->wait().ok());
  EXPECT_EQ(queue.stats().applied_inline, 0u);
  EXPECT_EQ(queue.stats().applied, 1u);
}

TEST_F(UpdateQueueTest, ABatchThatChangesInstancesIsNotAppliedByItsCaller) {
  UpdateQueue queue({});
  const std::vector<uint64_t> ids = {50};
  const auto update = move({1}, 5);
  update->change().instance_relabels.emplace_back().ids = ids;
  ASSERT_TRUE(queue.post(scene_, *update, WhenFull::kRefuse).ok());
  EXPECT_EQ(update->wait()->refused, 1u);
  EXPECT_EQ(x_of(1), 5);
  EXPECT_EQ(queue.stats().applied_inline, 0u);
}

// The time of a batch that changes instances depends on how many there are, and tells nothing about other batches.
TEST_F(UpdateQueueTest, BatchesThatChangeInstancesDoNotRaiseTheEstimateForOtherBatches) {
  std::vector<double> translations(3 * 50'000);
  for (size_t i = 0; i < translations.size(); ++i) translations[i] = static_cast<double>(i * i % 10'007);
  StaticChange change;
  change.place.emplace_back().mesh = test::make_mesh("m", 1);
  change.place[0].translations = translations;
  const std::vector<Id> placed = scene_->change_instances(change)->placed;
  UpdateQueue queue({});
  for (double x = 0; x < 30; ++x) {
    std::vector<Id> ids;
    for (size_t i = 0; i < 64; ++i) ids.push_back(placed[i * 700]);
    const std::vector<double> to = {x, x, x};
    const auto update = move({1}, 5);
    update->change().instance_moves.emplace_back().ids = ids;
    update->change().instance_moves[0].positions_f64 = to;
    ASSERT_TRUE(queue.post(scene_, *update, WhenFull::kRefuse).ok());
    EXPECT_EQ(update->wait()->applied, 65u);
  }
  std::vector<uint64_t> many;  // too few for the estimate to learn from
  for (uint64_t id = 1000; id < 1060; ++id) many.push_back(id);
  // The queue may not have marked the scene as idle again when the last batch is done.
  const auto inlined = [&queue] { return queue.stats().applied_inline; };
  for (int tries = 0; tries < 1000 && inlined() == 0; ++tries) {
    const auto update = move(many, 1);
    ASSERT_TRUE(queue.post(scene_, *update, WhenFull::kRefuse).ok());
    EXPECT_TRUE(update->wait().ok());
  }
  EXPECT_NE(inlined(), 0u);
}

TEST_F(UpdateQueueTest, TheItemsOfABatchAreCountedOnceWhenItIsPosted) {
  UpdateQueue queue(without_inline());
  const auto held = occupy(queue);
  const auto update = move({1, 2}, 5);
  ASSERT_TRUE(queue.post(scene_, *update, WhenFull::kRefuse).ok());
  EXPECT_EQ(queue.stats().items, 2u);
  UpdateBatch message;
  const std::vector<uint64_t> ids = {7, 8, 9};
  message.remove_ids = ids;
  update->change().earlier.assign(2, message);  // another count would see these messages
  held->release();
  EXPECT_EQ(update->wait()->refused, 6u);
  EXPECT_EQ(queue.stats().items, 0u);
}

TEST_F(UpdateQueueTest, ACallerNeverWaitsForThePreviousBatch) {
  UpdateQueue queue({});
  const auto held = move({1}, 1);
  held->hold();
  std::thread other([&] { EXPECT_TRUE(queue.post(scene_, *held, WhenFull::kRefuse).ok()); });
  held->wait_until_checked();
  const auto next = move({1}, 2);
  ASSERT_TRUE(queue.post(scene_, *next, WhenFull::kRefuse).ok());
  EXPECT_FALSE(next->is_done());
  held->release();
  other.join();
  EXPECT_EQ(next->wait()->revision, held->wait()->revision + 1);
  EXPECT_EQ(x_of(1), 2);
}

TEST_F(UpdateQueueTest, BatchesOfASceneAreAppliedInTheOrderOfArrival) {
  UpdateQueue queue(without_inline(3));
  std::vector<std::unique_ptr<Points>> updates;
  for (int i = 0; i < 200; ++i) {
    updates.push_back(move({1}, static_cast<float>(i + 1)));
    ASSERT_TRUE(queue.post(scene_, *updates.back(), WhenFull::kHold).ok());
  }
  for (size_t i = 0; i < updates.size(); ++i) EXPECT_EQ(updates[i]->wait()->revision, 2 + i) << "each its own";
  EXPECT_EQ(x_of(1), 200);
  EXPECT_EQ(queue.stats().coalesced, 0u);
}

TEST_F(UpdateQueueTest, ScenesDoNotWaitForEachOther) {
  UpdateQueue queue(without_inline(2));
  const auto held = occupy(queue);
  const ScenePtr other = make_scene();
  const auto update = insert({1});
  ASSERT_TRUE(queue.post(other, *update, WhenFull::kRefuse).ok());
  EXPECT_TRUE(update->wait().ok());
  EXPECT_FALSE(held->is_done());
  held->release();
  EXPECT_TRUE(held->wait().ok());
}

TEST_F(UpdateQueueTest, AFullSceneQueueRefusesAtOnceAndHoldsStreams) {
  UpdateQueueOptions options = without_inline();
  options.max_updates = 2;
  UpdateQueue queue(options);
  const auto held = occupy(queue);
  const auto first = move({1}, 1), second = move({1}, 2), refused = move({1}, 3), streamed = move({1}, 4);
  EXPECT_EQ(*queue.post(scene_, *first, WhenFull::kRefuse), Posted::kTaken);
  EXPECT_EQ(*queue.post(scene_, *second, WhenFull::kRefuse), Posted::kTaken);
  const absl::Status status = queue.post(scene_, *refused, WhenFull::kRefuse).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal_of(status)->limit, "waiting_updates");
  EXPECT_EQ(refusal_of(status)->limit_value, 2);
  EXPECT_GE(refusal_of(status)->retry_after_ms, 1u);
  EXPECT_EQ(*queue.post(scene_, *streamed, WhenFull::kHold), Posted::kFull);
  EXPECT_EQ(queue.stats().updates, 3u);
  EXPECT_EQ(queue.stats().refused, 1u);
  EXPECT_EQ(queue.stats().held, 1u);
  held->release();
  EXPECT_TRUE(streamed->wait().ok());
  EXPECT_FALSE(refused->is_done());
  EXPECT_EQ(x_of(1), 4);
}

TEST_F(UpdateQueueTest, TheItemsOfASceneQueueAreLimitedButOneBatchIsAlwaysAccepted) {
  UpdateQueueOptions options = without_inline();
  options.max_items = 3;
  UpdateQueue queue(options);
  const auto held = occupy(queue);
  const auto large = move({1, 2, 3, 1, 2, 3}, 1), small = move({1}, 2);
  EXPECT_TRUE(queue.post(scene_, *large, WhenFull::kRefuse).ok());
  const absl::Status status = queue.post(scene_, *small, WhenFull::kRefuse).status();
  EXPECT_EQ(refusal_of(status)->limit, "waiting_update_items");
  EXPECT_EQ(refusal_of(status)->asked, 7);
  held->release();
  EXPECT_TRUE(large->wait().ok());
}

TEST_F(UpdateQueueTest, ACancelledBatchIsNotApplied) {
  UpdateQueue queue(without_inline());
  const auto held = occupy(queue);
  const auto cancelled = move({1}, 1), wanted = move({2}, 1);
  ASSERT_TRUE(queue.post(scene_, *cancelled, WhenFull::kRefuse).ok());
  ASSERT_TRUE(queue.post(scene_, *wanted, WhenFull::kRefuse).ok());
  cancelled->cancel();
  held->release();
  EXPECT_EQ(cancelled->wait().status().code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(wanted->wait().ok());
  EXPECT_EQ(x_of(1), -1);
}

TEST_F(UpdateQueueTest, ARefusedBatchDoesNotDelayTheNext) {
  UpdateQueue queue(without_inline());
  const auto wrong = move({1}, 1), right = move({1}, 2);
  wrong->change().moves[0].positions = {};
  ASSERT_TRUE(queue.post(scene_, *wrong, WhenFull::kRefuse).ok());
  ASSERT_TRUE(queue.post(scene_, *right, WhenFull::kRefuse).ok());
  EXPECT_EQ(wrong->wait().status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(right->wait().ok());
}

// A reader keeps its snapshot although its pin was revoked. Updates of the pinned scene wait, but updates of other
// scenes do not, because the queue's thread is not blocked.
TEST_F(UpdateQueueTest, AReaderThatHoldsTooMuchStallsItsOwnSceneOnly) {
  const ScenePtr pinned = make_scene(OverloadPolicy::kEveryBatch, limits::kMinPinnedBytes);
  std::vector<uint64_t> ids(50'000);
  for (size_t i = 0; i < ids.size(); ++i) ids[i] = i + 1;
  UpdateQueue queue(without_inline());
  const auto fill = insert(ids);
  ASSERT_TRUE(queue.post(pinned, *fill, WhenFull::kRefuse).ok());
  ASSERT_TRUE(fill->wait().ok());
  std::optional<SnapshotPin> pin = *pinned->pin({}, kNow);
  std::vector<std::unique_ptr<Points>> moves;
  float x = 0;
  while (pin->status().ok()) {
    moves.push_back(move(ids, ++x));
    ASSERT_TRUE(queue.post(pinned, *moves.back(), WhenFull::kRefuse).ok());
    ASSERT_TRUE(moves.back()->wait().ok());
  }
  const auto stalled = move(ids, ++x), elsewhere = move({1}, 7);
  ASSERT_TRUE(queue.post(pinned, *stalled, WhenFull::kRefuse).ok());
  ASSERT_TRUE(queue.post(scene_, *elsewhere, WhenFull::kRefuse).ok());
  EXPECT_TRUE(elsewhere->wait().ok()) << "by the only thread";
  while (queue.stats().stalls == 0) std::this_thread::yield();
  EXPECT_FALSE(stalled->is_done());
  pin.reset();
  EXPECT_TRUE(stalled->wait().ok());
}

TEST_F(UpdateQueueTest, TheDestructorFinishesEveryBatch) {
  std::vector<std::unique_ptr<Points>> updates;
  {
    UpdateQueue queue(without_inline(2));
    const auto held = occupy(queue);
    for (int i = 0; i < 20; ++i) {
      updates.push_back(move({1}, static_cast<float>(i)));
      ASSERT_TRUE(queue.post(scene_, *updates.back(), WhenFull::kHold).ok());
    }
    std::thread later([&held] { held->release(); });
    later.join();
    held->wait();
  }
  for (const auto& update : updates) EXPECT_TRUE(update->is_done());
}

TEST_F(UpdateQueueTest, NoBatchOfConcurrentCallersIsLost) {
  UpdateQueue queue({2});
  constexpr int kEach = 300;
  std::vector<std::thread> senders;
  for (uint64_t sender = 1; sender <= 3; ++sender)
    senders.emplace_back([&, sender] {
      uint64_t last = 0;
      for (int i = 1; i <= kEach; ++i) {
        const auto update = move({sender}, static_cast<float>(i));
        EXPECT_TRUE(queue.post(scene_, *update, WhenFull::kHold).ok());
        const uint64_t revision = update->wait()->revision;
        EXPECT_GT(revision, last);
        last = revision;
      }
    });
  for (std::thread& sender : senders) sender.join();
  EXPECT_EQ(scene_->latest()->revision, 1u + 3 * kEach);
  for (const Id id : {1, 2, 3}) EXPECT_EQ(x_of(id), kEach);
  EXPECT_EQ(queue.stats().applied, 3u * kEach);
}

TEST_F(LatestWinsTest, WaitingMovesBecomeOneRevision) {
  UpdateQueue queue(without_inline());
  const auto held = occupy(queue);
  std::vector<std::unique_ptr<Points>> moves;
  for (int i = 1; i <= 10; ++i) {
    moves.push_back(move({1, static_cast<uint64_t>(2 + i % 2)}, static_cast<float>(i)));
    ASSERT_TRUE(queue.post(scene_, *moves.back(), WhenFull::kRefuse).ok());
  }
  held->release();
  std::vector<uint64_t> revisions;
  for (const auto& update : moves) revisions.push_back(update->wait()->revision);
  EXPECT_THAT(revisions, Each(held->wait()->revision + 1));
  EXPECT_EQ(x_of(1), 10);
  EXPECT_EQ(x_of(2), 10);
  EXPECT_EQ(x_of(3), 9);
  EXPECT_EQ(queue.stats().coalesced, 9u);
  EXPECT_EQ(scene_->status().joined_updates, 9u);
}

TEST_F(LatestWinsTest, NoBatchOvertakesOneThatIsMoreThanMoves) {
  UpdateQueue queue(without_inline());
  const auto held = occupy(queue);
  const auto before = move({1}, 1), middle = insert({4}), after = move({1, 4}, 2), last = move({1, 4}, 3);
  for (Points* update : {before.get(), middle.get(), after.get(), last.get()})
    ASSERT_TRUE(queue.post(scene_, *update, WhenFull::kRefuse).ok());
  held->release();
  const uint64_t first = before->wait()->revision;
  EXPECT_EQ(middle->wait()->revision, first + 1);
  EXPECT_EQ(after->wait()->revision, first + 2);
  EXPECT_EQ(last->wait()->revision, first + 2);
  EXPECT_EQ(after->wait()->refused, 0u);
  EXPECT_EQ(x_of(4), 3);
}

TEST_F(LatestWinsTest, MovesOfAnotherTickAreAnotherRevision) {
  UpdateQueue queue(without_inline());
  const auto held = occupy(queue);
  const auto tick_one = move({1}, 1), tick_two = move({1}, 2);
  tick_one->change().tick = 1;
  tick_two->change().tick = 2;
  for (Points* update : {tick_one.get(), tick_two.get()})
    ASSERT_TRUE(queue.post(scene_, *update, WhenFull::kRefuse).ok());
  held->release();
  EXPECT_EQ(tick_one->wait()->tick, 1u);
  EXPECT_EQ(tick_two->wait()->revision, tick_one->wait()->revision + 1);
}

TEST_F(LatestWinsTest, ACancelledBatchIsLeftOutOfTheGroup) {
  UpdateQueue queue(without_inline());
  const auto held = occupy(queue);
  const auto first = move({1}, 1), cancelled = move({1, 2}, 2);
  for (Points* update : {first.get(), cancelled.get()})
    ASSERT_TRUE(queue.post(scene_, *update, WhenFull::kRefuse).ok());
  cancelled->cancel();
  held->release();
  EXPECT_TRUE(first->wait().ok());
  EXPECT_FALSE(cancelled->wait().ok());
  EXPECT_EQ(x_of(1), 1);
  EXPECT_EQ(x_of(2), 0);
}

// Fixture with a scene whose acks wait for the log.
class LoggedUpdateQueueTest : public testing::Test {
 protected:
  LoggedUpdateQueueTest() {
    const absl::StatusOr<Registry::CreatedScene> created = registry_.create_scene("arena", {}, 5, "", false);
    EXPECT_TRUE(created.ok()) << created.status();
    scene_ = created->scene;
  }

  test::MemoryLog log_;
  Registry registry_{&log_};
  ScenePtr scene_;
};

TEST_F(LoggedUpdateQueueTest, OneSyncServesAllWaitingBatchesAndEachIsARevision) {
  constexpr uint64_t kBatches = 200;
  std::vector<std::unique_ptr<Points>> batches;
  for (uint64_t i = 1; i <= kBatches; ++i) batches.push_back(insert({i}));
  UpdateQueueOptions options;
  options.max_updates = kBatches;
  UpdateQueue queue(options);
  const uint64_t before = log_.appends();
  log_.hold();
  for (const auto& batch : batches) ASSERT_TRUE(queue.post(scene_, *batch, WhenFull::kRefuse).ok());
  log_.release();
  for (uint64_t i = 0; i < kBatches; ++i) {
    const absl::StatusOr<UpdateAck>& ack = batches[i]->wait();
    ASSERT_TRUE(ack.ok()) << ack.status();
    EXPECT_EQ(ack->revision, i + 1);
  }
  EXPECT_LE(log_.appends() - before, 2u) << "one for the first batch, one for all that waited during it";
  EXPECT_EQ(scene_->log_position().sequence, kBatches);
  const UpdateQueueStats stats = queue.stats();
  EXPECT_EQ(stats.applied_inline, 0u) << "callers must not wait for the disk";
  EXPECT_EQ(stats.coalesced, 0u);
}

TEST_F(LoggedUpdateQueueTest, EmptyListsCountForTheSizeOfOneSync) {
  constexpr uint64_t kBatches = 7;
  constexpr size_t kLists = 10'000;  // three batches with so many lists fit into one sync
  std::vector<std::unique_ptr<Points>> batches;
  for (uint64_t i = 1; i <= kBatches; ++i) {
    batches.push_back(insert({i}));
    batches.back()->change().moves.resize(kLists);
  }
  UpdateQueue queue(UpdateQueueOptions{});
  const uint64_t before = log_.appends();
  log_.hold();
  for (const auto& batch : batches) ASSERT_TRUE(queue.post(scene_, *batch, WhenFull::kRefuse).ok());
  log_.release();
  for (const auto& batch : batches) EXPECT_TRUE(batch->wait().ok()) << batch->wait().status();
  EXPECT_GE(log_.appends() - before, 3u);
}

TEST_F(LoggedUpdateQueueTest, AFullDiskRefusesUpdatesUntilSpaceIsFree) {
  UpdateQueue queue(UpdateQueueOptions{});
  log_.fail_with(absl::ResourceExhaustedError("full"));
  const auto refused = insert({1});
  ASSERT_TRUE(queue.post(scene_, *refused, WhenFull::kRefuse).ok());
  EXPECT_EQ(refused->wait().status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(scene_->latest()->revision, 0u);
  EXPECT_EQ(queue.stats().applied, 0u);
  log_.fail_with(absl::OkStatus());
  const auto applied = insert({1});
  ASSERT_TRUE(queue.post(scene_, *applied, WhenFull::kRefuse).ok());
  EXPECT_TRUE(applied->wait().ok());
  EXPECT_EQ(scene_->latest()->revision, 1u);
  EXPECT_EQ(queue.stats().applied, 1u);
}

}  // namespace
}  // namespace locus::server
