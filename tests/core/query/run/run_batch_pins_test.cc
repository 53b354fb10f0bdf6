// Readers that take their time beside a writer at full speed: what they hold is bounded, they are ended, and nobody
// else notices.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <thread>

#include "core/query/run/run_batch.h"
#include "core/scene/scene.h"
#include "tests/support/small_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr uint64_t kObjects = 1'000;
constexpr Scene::Deadline kNow = Scene::Deadline::min();

// All objects move with every revision, to x = its number.
class RunBatchPinsTest : public ::testing::Test {
 protected:
  RunBatchPinsTest() : ids_(kObjects), positions_(3 * kObjects), scene_(empty(0)) {
    for (uint64_t i = 0; i < kObjects; ++i) ids_[i] = i + 1;
    UpdateBatch batch;
    InsertColumns insert;
    insert.ids = ids_;
    insert.positions = positions_at(1);
    batch.inserts.push_back(insert);
    // What all objects take says what readers may hold.
    EXPECT_TRUE(scene_->apply(batch).ok());
    scene_bytes_ = scene_->status().memory_bytes;
    scene_ = empty(kRevisions * scene_bytes_);
    EXPECT_TRUE(scene_->apply(batch).ok());
  }

  // Revisions that readers may hold.
  static constexpr uint64_t kRevisions = 8;

  static std::unique_ptr<Scene> empty(uint64_t pinned_bytes) {
    SceneSpec spec;
    spec.pinned_bytes = pinned_bytes;
    return std::make_unique<Scene>("scene", spec, 1, StaticSet::empty());
  }

  absl::Span<const float> positions_at(uint64_t revision) {
    for (uint64_t i = 0; i < kObjects; ++i) {
      positions_[3 * i] = float(revision);
      positions_[3 * i + 1] = float(i);
    }
    return positions_;
  }

  // One thread's.
  void advance() {
    UpdateBatch batch;
    MoveColumns move;
    move.ids = ids_;
    move.positions = positions_at(scene_->latest()->revision + 1);
    batch.moves.push_back(move);
    ASSERT_TRUE(scene_->apply(batch).ok());
  }

  // Told to end as long before the latest revision as readers may hold at most; what one more revision and the next
  // count add comes on top.
  void expect_bounded() const {
    const SceneStatus status = scene_->status();
    EXPECT_LE(status.pinned_bytes, status.max_pinned_bytes + status.max_pinned_bytes / 16 + 2 * scene_bytes_);
  }

  // `pins` are oldest first, as they are told to end.
  static uint64_t drop_told(std::deque<SnapshotPin>& pins) {
    uint64_t dropped = 0;
    for (; !pins.empty() && !pins.front().status().ok(); ++dropped) pins.pop_front();
    return dropped;
  }

  static absl::StatusOr<BatchResult> ask(const SnapshotPin& pin, std::function<absl::Status()> stop) {
    static const OwnedBlock block = lookup_of_ids({1, kObjects});
    QueryBatch batch;
    batch.blocks = {block.view()};
    RunOptions options;
    options.stop = std::move(stop);
    return run_batch(*pin, batch, options);
  }

  std::vector<uint64_t> ids_;
  std::vector<float> positions_;
  uint64_t scene_bytes_ = 0;
  std::unique_ptr<Scene> scene_;
};

TEST_F(RunBatchPinsTest, ABatchThatHoldsTooMuchEndsAtItsNextCheckAndTheWriterGoesOn) {
  std::atomic<bool> begun{false}, told{false};
  std::thread reader([&] {
    const SnapshotPin pin = *scene_->pin({}, kNow);
    const absl::StatusOr<BatchResult> answer = ask(pin, [&] {
      begun = true;
      while (pin.status().ok()) std::this_thread::yield();
      told = true;
      return pin.status();
    });
    EXPECT_EQ(answer.status().code(), absl::StatusCode::kResourceExhausted);
  });
  while (!begun) std::this_thread::yield();
  // Younger than the batch's, until together they hold too much.
  std::deque<SnapshotPin> others;
  while (!told) {
    others.push_back(*scene_->pin({}, kNow));
    advance();
    expect_bounded();
    drop_told(others);
  }
  reader.join();
  EXPECT_GE(others.size(), kRevisions / 2) << "no more are told to end than it takes";
  const uint64_t before = scene_->latest()->revision;
  for (int i = 0; i < 10; ++i) {
    advance();
    drop_told(others);
  }
  EXPECT_EQ(scene_->latest()->revision, before + 10);
}

TEST_F(RunBatchPinsTest, ABatchThatHoldsItsRevisionForLongIsAnswered) {
  const uint64_t turns = scaled_count(500);
  std::atomic<bool> done{false};
  std::atomic<bool> begun{false};
  std::thread reader([&] {
    const SnapshotPin pin = *scene_->pin({}, kNow);
    const absl::StatusOr<BatchResult> answer = ask(pin, [&] {
      begun = true;
      while (!done && pin.status().ok()) std::this_thread::yield();
      return pin.status();
    });
    EXPECT_TRUE(answer.ok()) << answer.status();
  });
  while (!begun) std::this_thread::yield();
  for (uint64_t i = 0; i < turns; ++i) advance();
  EXPECT_GT(scene_->latest()->replaced_bytes, scene_->spec().pinned_bytes);
  done = true;
  reader.join();
}

// One reader keeps every revision it sees until it is told to end, oldest first; beside it others are quick.
TEST_F(RunBatchPinsTest, QuickReadersAreNeverToldToEndBesideOneThatKeepsAll) {
  const uint64_t turns = scaled_count(2'000);
  std::atomic<bool> done{false};
  std::atomic<uint64_t> quick{0}, told{0};
  std::thread hoarder([&] {
    std::deque<SnapshotPin> kept;
    uint64_t seen = 0;
    while (!done) {
      // No more than one for each answer to the others, so that theirs are never the oldest of too many.
      if (quick > seen) {
        seen = quick;
        kept.push_back(*scene_->pin({}, kNow));
      }
      told += drop_told(kept);
      std::this_thread::yield();
    }
  });
  std::thread reader([&] {
    while (!done) {
      const SnapshotPin pin = *scene_->pin({}, kNow);
      const absl::StatusOr<BatchResult> answer = ask(pin, [&pin] { return pin.status(); });
      ASSERT_TRUE(answer.ok()) << answer.status();
      EXPECT_THAT(answer->blocks[0].ids, ::testing::ElementsAre(1, kObjects));
      EXPECT_EQ(pin->objects.find(1)->shape.position.x, double(pin->revision));
      ++quick;
    }
  });
  // A reader that failed asks no more, and without it nothing is told to end.
  for (uint64_t i = 0; (i < turns || told == 0) && !HasFailure(); ++i) {
    advance();
    expect_bounded();
  }
  done = true;
  hoarder.join();
  reader.join();
}

}  // namespace
}  // namespace locus::test
