// Scenes that follow another server's leader record by record. Random sequences are in recovery_test.cc.
#include "core/scene/record_applier.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/scene/log/record_codec.h"
#include "core/scene/recovery.h"
#include "tests/support/memory_log.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

using std::chrono::seconds;
using std::chrono::steady_clock;

class FollowedSceneTest : public SceneFixture {
 protected:
  FollowedSceneTest() {
    EXPECT_TRUE(registry_.add_mesh("m", mesh_).ok());
    leader_ = registry_.create_scene("arena", {}, kEpoch, "", false)->scene;
    follower_ =
        *recover_scene(log_, MemoryLog(log_.crash()).stored_scenes().front(), nullptr, nullptr, LogUse::kReadOnly);
  }

  // Passes the leader's records after `from` to the follower.
  absl::Status feed(uint64_t from = 0) {
    return log_.read(leader_->log_key(), from + 1,
                     [this](const LogRecord& record) { return follower_->follow(record.entry, find_).status(); });
  }

  MemoryLog log_;
  Registry registry_{&log_};
  ScenePtr leader_, follower_;
  MeshOfRecord find_ = [this](const MeshKey&, const Aabbf*) { return mesh_; };
};

TEST_F(FollowedSceneTest, ReadersOfTheFollowerWaitForARevisionAsAtTheLeader) {
  std::thread reader([this] {
    const auto snapshot = follower_->view({View::Kind::kAtLeast, 2, kEpoch}, steady_clock::now() + seconds(60));
    ASSERT_TRUE(snapshot.ok()) << snapshot.status();
    EXPECT_GE((*snapshot)->revision, 2u);
  });
  ASSERT_TRUE(leader_->apply(with(points({1}, {0, 0, 0}))).ok());
  ASSERT_TRUE(leader_->apply(with(points({2}, {1, 0, 0}))).ok());
  ASSERT_EQ(feed(), absl::OkStatus());
  reader.join();
  EXPECT_EQ(follower_->latest()->revision, leader_->latest()->revision);
  EXPECT_TRUE(follower_->view({View::Kind::kExactly, 1, kEpoch}, steady_clock::now()).ok()) << "each one is published";
}

TEST_F(FollowedSceneTest, RecordsOfAnotherEpochAreRefusedAndChangeNothing) {
  ASSERT_TRUE(leader_->apply(with(points({1}, {0, 0, 0}))).ok());
  const absl::Status read = log_.read(leader_->log_key(), 1, [this](const LogRecord& record) {
    LogEntry other = record.entry;
    other.epoch = kEpoch + 1;
    return follower_->follow(other, find_).status();
  });
  EXPECT_EQ(read.code(), absl::StatusCode::kFailedPrecondition) << read;
  EXPECT_EQ(follower_->latest()->revision, 0u);
}

TEST_F(FollowedSceneTest, DamagedRecordsAndThoseThatDoNotFitAreDamageAndChangeNothing) {
  const LogEntry damaged = {kEpoch, 0, 0, "no record"};
  EXPECT_EQ(follower_->follow(damaged, find_).status().code(), absl::StatusCode::kDataLoss);
  const Id unknown = 5;
  StaticChange change;
  change.remove_ids = {&unknown, 1};
  std::string bytes;
  encode_change(change, {}, bytes);
  EXPECT_EQ(follower_->follow({kEpoch, 0, 0, bytes}, find_).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(follower_->latest()->revision, 0u);
}

TEST_F(FollowedSceneTest, AClosedFollowerReturnsTheReason) {
  ASSERT_TRUE(leader_->apply(with(points({1}, {0, 0, 0}))).ok());
  follower_->close(absl::UnavailableError("it follows no more"));
  EXPECT_EQ(feed(), absl::UnavailableError("it follows no more"));
}

TEST_F(FollowedSceneTest, APromotedFollowerAppendsToTheLogAndKnowsTheWriters) {
  const UpdateBatch first = numbered(with(points({1}, {0, 0, 0})), 3, 1);
  ASSERT_TRUE(leader_->apply(first).ok());
  ASSERT_EQ(feed(), absl::OkStatus());
  const LogPosition position = leader_->log_position();
  leader_->close(absl::UnavailableError("fenced"));
  follower_->begin_leading({&log_, leader_->log_key(), AckLevel::kLocal, position});
  const auto again = follower_->apply(first);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->duplicate);
  ASSERT_TRUE(follower_->apply(numbered(with(points({2}, {1, 0, 0})), 3, 2)).ok());
  const ScenePtr recovered = *recover_scene(log_, MemoryLog(log_.crash()).stored_scenes().front(), nullptr);
  EXPECT_EQ(recovered->latest()->revision, 2u);
  EXPECT_EQ(recovered->latest()->objects.size(), 2u);
}

// For ThreadSanitizer: queries of a follower while records arrive.
TEST_F(FollowedSceneTest, QueriesAndRecordsRunAtTheSameTime) {
  constexpr uint64_t kRecords = 400;
  std::atomic<bool> ended{false};
  std::vector<std::thread> readers;
  for (int i = 0; i < 2; ++i)
    readers.emplace_back([&] {
      uint64_t last = 0;
      while (!ended) {
        const uint64_t now = follower_->latest()->revision;
        EXPECT_LE(last, now) << "revisions never go back";
        last = now;
      }
    });
  for (Id id = 1; id <= kRecords; ++id) {
    ASSERT_TRUE(leader_->apply(with(points({id}, {0, 0, 0}))).ok());
    ASSERT_EQ(feed(id - 1), absl::OkStatus());
  }
  ended = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(follower_->latest()->objects.size(), kRecords);
}

}  // namespace
}  // namespace locus::test
