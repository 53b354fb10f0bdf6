// Tests slow readers while a writer runs at full speed: the memory that the readers pin is bounded, their pins are
// revoked, and other readers are not affected.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <thread>

#include "core/scene/scene.h"
#include "tests/support/run_batch.h"
#include "tests/support/small_world.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr uint64_t kObjects = 1'000;
constexpr Scene::Deadline kNow = Scene::Deadline::min();

// Scene whose objects all move in every revision; the x coordinate of each object is the number of the revision.
class RunBatchPinsTest : public ::testing::Test {
 protected:
  RunBatchPinsTest() : ids_(kObjects), positions_(3 * kObjects), scene_(empty(0)) {
    for (uint64_t i = 0; i < kObjects; ++i) ids_[i] = i + 1;
    UpdateBatch batch;
    InsertColumns insert;
    insert.ids = ids_;
    insert.positions = positions_at(1);
    batch.inserts.push_back(insert);
    // Measures the size of a revision, from which the limit of pinned bytes is derived.
    EXPECT_TRUE(scene_->apply(batch).ok());
    scene_bytes_ = scene_->status().memory_bytes;
    scene_ = empty(kRevisions * scene_bytes_);
    EXPECT_TRUE(scene_->apply(batch).ok());
  }

  // Number of revisions that readers may pin.
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

  // Publishes the next revision. Only one thread may call it.
  void advance() {
    UpdateBatch batch;
    MoveColumns move;
    move.ids = ids_;
    move.positions = positions_at(scene_->latest()->revision + 1);
    batch.moves.push_back(move);
    ASSERT_TRUE(scene_->apply(batch).ok());
  }

  // Expects that the pinned bytes exceed the limit by at most 1/16 of the limit plus the size of two revisions. Readers
  // can pin 1/16 of the limit before the bytes are counted again.
  void expect_bounded() const {
    const SceneStatus status = scene_->status();
    EXPECT_LE(status.pinned_bytes, status.max_pinned_bytes + status.max_pinned_bytes / 16 + 2 * scene_bytes_);
  }

  // Drops the revoked pins from the front of `pins` and returns their number. `pins` ascend by revision, and the oldest
  // pins are revoked first.
  static uint64_t drop_revoked(std::deque<SnapshotPin>& pins) {
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

TEST_F(RunBatchPinsTest, ABatchThatPinsTooMuchEndsAtItsNextCheckAndTheWriterContinues) {
  std::atomic<bool> begun{false}, revoked{false};
  std::thread reader([&] {
    const SnapshotPin pin = *scene_->pin({}, kNow);
    const absl::StatusOr<BatchResult> answer = ask(pin, [&] {
      begun = true;
      while (pin.status().ok()) std::this_thread::yield();
      revoked = true;
      return pin.status();
    });
    EXPECT_EQ(answer.status().code(), absl::StatusCode::kResourceExhausted);
  });
  while (!begun) std::this_thread::yield();
  // Pins newer revisions until the pins together exceed the limit and the reader's pin is revoked.
  std::deque<SnapshotPin> others;
  while (!revoked) {
    others.push_back(*scene_->pin({}, kNow));
    advance();
    expect_bounded();
    drop_revoked(others);
  }
  reader.join();
  EXPECT_GE(others.size(), kRevisions / 2) << "no more pins are revoked than necessary";
  const uint64_t before = scene_->latest()->revision;
  for (int i = 0; i < 10; ++i) {
    advance();
    drop_revoked(others);
  }
  EXPECT_EQ(scene_->latest()->revision, before + 10);
}

TEST_F(RunBatchPinsTest, ABatchThatPinsOneRevisionForLongIsAnswered) {
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

// One reader, `hoarder`, holds pins until they are revoked; another reader releases each pin quickly.
TEST_F(RunBatchPinsTest, QuickReadersAreNeverRevokedBesideOneThatKeepsAllRevisions) {
  const uint64_t turns = scaled_count(2'000);
  std::atomic<bool> done{false};
  std::atomic<uint64_t> quick{0}, revoked{0};
  std::thread hoarder([&] {
    std::deque<SnapshotPin> kept;
    uint64_t seen = 0;
    while (!done) {
      // Pins at most one revision for each answer of the quick reader, so that the quick reader's pin is never the
      // oldest when the pins exceed the limit.
      if (quick > seen) {
        seen = quick;
        kept.push_back(*scene_->pin({}, kNow));
      }
      revoked += drop_revoked(kept);
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
  // The loop ends on failure, because it might never end otherwise: if the quick reader fails, the hoarder pins no
  // further revisions, so that no further pin is revoked.
  for (uint64_t i = 0; (i < turns || revoked == 0) && !HasFailure(); ++i) {
    advance();
    expect_bounded();
  }
  done = true;
  hoarder.join();
  reader.join();
}

}  // namespace
}  // namespace locus::test
