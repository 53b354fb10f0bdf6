// Tests ReaderTracker through a scene: the memory that readers may hold, and updates that wait for readers.
#include "core/scene/readers/reader_tracker.h"

#include <atomic>
#include <optional>
#include <thread>

#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

class ReaderTrackerTest : public SceneFixture {
 protected:
  static constexpr Scene::Deadline kNow = Scene::Deadline::min();

  // Budget of pinned bytes: about four times the memory of all objects, assuming 300 bytes for each object.
  static constexpr uint64_t kObjects = 2'000;
  static constexpr uint64_t kBudget = 4 * 300 * kObjects;
  static SceneSpec bounded(uint64_t budget) {
    SceneSpec spec;
    spec.pinned_bytes = budget;
    return spec;
  }

  explicit ReaderTrackerTest(uint64_t budget = kBudget) : SceneFixture(bounded(budget)) {
    std::vector<float> positions;
    for (Id id = 1; id <= kObjects; ++id) {
      all_.push_back(id);
      positions.insert(positions.end(), {float(id % 50), float(id / 50), 0});
    }
    apply(with(points(all_, positions)));
  }

  // Returns a batch that moves all objects, so that no object of the previous revision is shared.
  UpdateBatch step() {
    return with(move_to(all_, std::vector<float>(3 * all_.size(), float(scene_.latest()->revision))));
  }
  // Applies step(). Returns DEADLINE_EXCEEDED if the update would have to wait for readers.
  absl::Status step_now() { return scene_.apply(step(), kNow).status(); }

  SnapshotPin pin(const View& view = {}) { return *scene_.pin(view, kNow); }

  // Repeatedly pins the latest revision and publishes a new revision, until the first pin is revoked. Returns all pins.
  std::vector<SnapshotPin> pin_too_much() {
    std::vector<SnapshotPin> pins;
    while (pins.empty() || pins.front().status().ok()) {
      pins.push_back(pin());
      EXPECT_TRUE(step_now().ok());
    }
    return pins;
  }

  std::vector<Id> all_;
};

class ReaderTrackerDefaultTest : public ReaderTrackerTest {
 protected:
  ReaderTrackerDefaultTest() : ReaderTrackerTest(0) {}
};

TEST_F(ReaderTrackerTest, ReadersOfTheLatestRevisionHoldNothing) {
  const SnapshotPin latest = pin();
  EXPECT_EQ(scene_.status().pinned_bytes, 0u);
  EXPECT_EQ(scene_.status().max_pinned_bytes, kBudget);
}

TEST_F(ReaderTrackerTest, SharedMemoryOfReadersIsCountedOnce) {
  const SnapshotPin first = pin(), again = pin();
  EXPECT_TRUE(step_now().ok());
  const SnapshotPin second = pin();
  EXPECT_TRUE(step_now().ok());
  EXPECT_EQ(scene_.status().pinned_bytes, unshared_bytes(*first, *second) + unshared_bytes(*second, *scene_.latest()));
}

TEST_F(ReaderTrackerTest, AReaderWithinTheBudgetIsNeverRevoked) {
  const SnapshotPin reader = pin();
  while (scene_.latest()->replaced_bytes - reader->replaced_bytes < 10 * kBudget) ASSERT_TRUE(step_now().ok());
  EXPECT_TRUE(reader.status().ok());
  EXPECT_LE(scene_.status().pinned_bytes, kBudget);
  EXPECT_EQ(reader->objects.find(1)->shape.position.x, 1);
}

TEST_F(ReaderTrackerTest, OnlyTheOldestPinsAreRevokedUntilTheRestFitsTheBudget) {
  const std::vector<SnapshotPin> pins = pin_too_much();
  ASSERT_GE(pins.size(), 3u);
  for (size_t i = 1; i < pins.size(); ++i) EXPECT_TRUE(pins[i].status().ok()) << i;
}

TEST_F(ReaderTrackerTest, AllReadersOfARevokedRevisionAreRevoked) {
  const SnapshotPin first = pin();
  const std::vector<SnapshotPin> pins = pin_too_much();
  EXPECT_FALSE(first.status().ok());
  EXPECT_FALSE(pins.front().status().ok());
}

TEST_F(ReaderTrackerTest, ARevokedReaderGetsAnErrorThatNamesTheLimit) {
  const absl::Status status = pin_too_much().front().status();
  expect_refusal(status, absl::StatusCode::kResourceExhausted, Reason::kLimit, "");
  const Refusal refusal = *refusal_of(status);
  EXPECT_EQ(refusal.limit, "pinned_bytes");
  EXPECT_EQ(refusal.limit_value, kBudget);
  EXPECT_GT(refusal.asked, kBudget);
  EXPECT_GT(refusal.retry_after_ms, 0u);
  EXPECT_NE(status.message().find("use smaller batches"), absl::string_view::npos) << status;
}

TEST_F(ReaderTrackerTest, UpdatesWaitUntilRevokedPinsAreReleased) {
  std::vector<SnapshotPin> pins = pin_too_much();
  const uint64_t before = revision();
  const absl::Status status = step_now();
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(refusal_of(status)->limit, "pinned_bytes");
  EXPECT_EQ(refusal_of(status)->limit_value, kBudget);
  EXPECT_EQ(revision(), before);
  std::vector<SnapshotPin> others;
  for (size_t i = 1; i < pins.size(); ++i) others.push_back(std::move(pins[i]));
  pins.clear();
  EXPECT_TRUE(step_now().ok());
}

TEST_F(ReaderTrackerTest, QueriesAreServedWhileUpdatesWaitForReaders) {
  const std::vector<SnapshotPin> pins = pin_too_much();
  const SnapshotPin latest = pin();
  EXPECT_EQ(latest->revision, revision());
  EXPECT_TRUE(latest.status().ok());
}

TEST_F(ReaderTrackerTest, AWaitingUpdateContinuesWhenTheReaderEnds) {
  std::vector<SnapshotPin> pins = pin_too_much();
  const uint64_t before = revision();
  std::thread writer([&, batch = step()] { EXPECT_TRUE(scene_.apply(batch).ok()); });
  EXPECT_EQ(revision(), before);
  pins.clear();
  writer.join();
  EXPECT_EQ(revision(), before + 1);
  EXPECT_EQ(scene_.status().pinned_bytes, 0u);
}

TEST_F(ReaderTrackerTest, AStaticChangeWaitsLikeAnUpdate) {
  std::vector<SnapshotPin> pins = pin_too_much();
  const uint64_t before = revision();
  std::thread writer([&] { EXPECT_TRUE(scene_.change_instances(placing(placement({kObjects + 1}, {0, 0, 0}))).ok()); });
  EXPECT_EQ(revision(), before);
  pins.clear();
  writer.join();
  EXPECT_EQ(revision(), before + 1);
}

TEST_F(ReaderTrackerTest, ClosingWakesAWaitingUpdate) {
  const std::vector<SnapshotPin> pins = pin_too_much();
  std::thread writer([&, batch = step()] {
    expect_refusal(scene_.apply(batch).status(), absl::StatusCode::kNotFound, Reason::kNotFound, "scene");
  });
  scene_.close();
  writer.join();
}

TEST_F(ReaderTrackerTest, APinOfAnOlderRevisionCountsTheBytesReplacedBefore) {
  EXPECT_TRUE(step_now().ok());
  EXPECT_TRUE(step_now().ok());
  const SnapshotPin old = pin({View::Kind::kExactly, 1, 0});
  EXPECT_EQ(scene_.status().pinned_bytes, unshared_bytes(*old, *scene_.latest()));
}

TEST_F(ReaderTrackerTest, PinsOfTheSameRevisionBeforeAndAfterTrimmingAreCountedSeparately) {
  SceneSpec spec = bounded(kBudget);
  spec.history = {10, uint64_t{1} << 30};
  Scene scene("trimmed", spec, 1, StaticSet::empty());
  const auto tick_to = [&](uint64_t tick) {
    UpdateBatch batch = with(points(all_, std::vector<float>(3 * all_.size(), float(tick))));
    batch.upsert = true;
    batch.tick = tick;
    ASSERT_TRUE(scene.apply(batch, kNow).ok());
  };
  for (uint64_t tick = 1; tick <= 3; ++tick) tick_to(tick);
  std::optional<SnapshotPin> before = *scene.pin({}, kNow);
  ASSERT_GT(scene.trim_history(0), 0u);
  const SnapshotPin after = *scene.pin({}, kNow);
  ASSERT_EQ((*before)->revision, after->revision);
  EXPECT_EQ(scene.status().pinned_bytes, unshared_bytes(**before, *after));
  EXPECT_GT(scene.status().pinned_bytes, 0u);
  before.reset();
  EXPECT_EQ(scene.status().pinned_bytes, 0u);
  tick_to(4);
  EXPECT_EQ(scene.status().pinned_bytes, unshared_bytes(*after, *scene.latest()));
  EXPECT_GT(scene.status().pinned_bytes, 0u);
  EXPECT_GT(scene.revoke_readers(0), 0u);
  EXPECT_FALSE(after.status().ok());
}

TEST_F(ReaderTrackerTest, OnRevokeIsCalledOnceAndOnlyForRevokedPins) {
  std::vector<SnapshotPin> pins = pin_too_much();
  int first = 0, last = 0;
  pins.front().on_revoke([&first] { ++first; });
  pins.back().on_revoke([&last] { ++last; });
  scene_.revoke_overdue_readers();
  scene_.revoke_overdue_readers();
  EXPECT_EQ(first, 1);
  EXPECT_EQ(last, 0);
}

TEST_F(ReaderTrackerTest, OnRevokeIsNotCalledAfterThePinIsReleased) {
  int cut = 0;
  {
    SnapshotPin reader = pin();
    reader.on_revoke([&cut] { ++cut; });
  }
  const std::vector<SnapshotPin> pins = pin_too_much();
  scene_.revoke_overdue_readers();
  EXPECT_EQ(cut, 0);
}

TEST_F(ReaderTrackerTest, APinMayOutliveItsScene) {
  std::optional<SnapshotPin> reader;
  {
    const Scene scene("short", SceneSpec(), 1, StaticSet::empty());
    reader.emplace(*scene.pin({}, kNow));
  }
  EXPECT_EQ((*reader)->epoch, 1u);
}

TEST_F(ReaderTrackerDefaultTest, TheDefaultBudgetGrowsWithALargeScene) {
  EXPECT_EQ(scene_.status().max_pinned_bytes, limits::kPinnedBytes);
  ReaderTracker tracker(0);
  const uint64_t large = limits::kPinnedBytes;
  EXPECT_EQ(tracker.use(*scene_.latest(), large).budget, limits::kPinnedShare * large);
}

}  // namespace
}  // namespace locus::test
