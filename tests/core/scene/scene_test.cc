// Tests views of a scene, waiting for a revision, and closing.
#include "core/scene/scene.h"

#include <atomic>
#include <thread>

#include "core/base/limits.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

using Deadline = std::chrono::steady_clock::time_point;

class SceneTest : public SceneFixture {
 protected:
  static constexpr Deadline kNow = Deadline::min();
  // Returns a deadline so late that only a deadlocked test reaches it.
  static Deadline far_away() { return std::chrono::steady_clock::now() + std::chrono::minutes(10); }

  static View exactly(uint64_t revision) { return {View::Kind::kExactly, revision, 0}; }
  static View at_least(uint64_t revision) { return {View::Kind::kAtLeast, revision, 0}; }

  // Applies `count` batches, each of which begins the next tick.
  void tick(uint64_t count) {
    for (uint64_t i = 0; i < count; ++i) {
      UpdateBatch batch;
      batch.tick = scene_.latest()->tick + 1;
      apply(batch);
    }
  }

  void expect_outside(uint64_t revision, const std::string& range) {
    const absl::Status status = scene_.view(exactly(revision), kNow).status();
    expect_refusal(status, absl::StatusCode::kOutOfRange, Reason::kOutOfRange, "view.exactly");
    EXPECT_NE(status.message().find(range), absl::string_view::npos) << status;
  }
};

TEST_F(SceneTest, LatestIsTheLastRevision) {
  tick(3);
  EXPECT_EQ((*scene_.view({}, kNow))->revision, 3u);
}

TEST_F(SceneTest, AtLeastAReachedRevisionDoesNotWait) {
  tick(3);
  EXPECT_EQ((*scene_.view(at_least(2), kNow))->revision, 3u);
  EXPECT_EQ((*scene_.view(at_least(3), kNow))->revision, 3u);
}

TEST_F(SceneTest, AtLeastALaterRevisionEndsAtTheDeadline) {
  tick(3);
  expect_refusal(scene_.view(at_least(4), kNow).status(), absl::StatusCode::kDeadlineExceeded, Reason::kOutOfRange,
                 "view.at_least");
}

TEST_F(SceneTest, AtLeastWaitsUntilTheRevisionIsPublished) {
  std::atomic<bool> seen{false};
  std::thread waiter([&] {
    const auto snapshot = scene_.view(at_least(2), far_away());
    ASSERT_TRUE(snapshot.ok());
    EXPECT_GE((*snapshot)->revision, 2u);
    seen = true;
  });
  tick(1);
  EXPECT_FALSE(seen);
  tick(1);
  waiter.join();
  EXPECT_TRUE(seen);
}

TEST_F(SceneTest, AStaticChangeWakesWaitersOfItsRevision) {
  std::thread waiter([&] {
    const auto snapshot = scene_.view(at_least(1), far_away());
    ASSERT_TRUE(snapshot.ok());
    EXPECT_EQ((*snapshot)->statics->size(), 1u);
  });
  EXPECT_TRUE(scene_.change_instances(placing(placement({8}, {0, 0, 0}))).ok());
  waiter.join();
}

TEST_F(SceneTest, ExactlyReturnsARecentRevisionUnchanged) {
  apply(with(points({1}, {1, 0, 0})));
  apply(with(move_to({1}, {2, 0, 0})));
  apply(removing({1}));
  const auto snapshot = scene_.view(exactly(1), kNow);
  ASSERT_TRUE(snapshot.ok());
  EXPECT_EQ((*snapshot)->objects.find(1)->shape.position.x, 1);
  EXPECT_EQ((*scene_.view(exactly(3), kNow))->objects.find(1), std::nullopt);
}

TEST_F(SceneTest, ExactlyTheNextRevisionIsOutOfRange) {
  tick(3);
  expect_outside(4, "0 to 3");
}

TEST_F(SceneTest, AtMostTheLimitOfRecentRevisionsIsKept) {
  tick(limits::kRecentRevisions + 5);
  const uint64_t newest = limits::kRecentRevisions + 5, oldest = newest - limits::kRecentRevisions + 1;
  EXPECT_EQ((*scene_.view(exactly(oldest), kNow))->revision, oldest);
  expect_outside(oldest - 1, std::to_string(oldest) + " to " + std::to_string(newest));
}

TEST_F(SceneTest, RecentRevisionsAreDroppedBeyondTheLimitOfReplacedBytes) {
  // A move of all objects replaces between a sixth and a fifth of limits::kRecentBytes, the limit of replaced bytes.
  std::vector<Id> all(limits::kRecentBytes / 420);
  for (uint64_t i = 0; i < all.size(); ++i) all[i] = i + 1;
  apply(with(points(all, {0, 0, 0})));
  for (int i = 1; i <= 5; ++i) apply(with(move_to(all, {float(i), 0, 0})));
  EXPECT_EQ((*scene_.view(exactly(1), kNow))->objects.find(1)->shape.position.x, 0);
  apply(with(move_to(all, {9, 0, 0})));
  expect_outside(1, "2 to 7");
  EXPECT_EQ((*scene_.view(exactly(2), kNow))->objects.find(1)->shape.position.x, 1);
}

TEST_F(SceneTest, ForgetRecentKeepsTheLatestRevisionAndLaterOnes) {
  tick(3);
  scene_.forget_recent();
  expect_outside(2, "3 to 3");
  EXPECT_EQ((*scene_.view(exactly(3), kNow))->revision, 3u);
  tick(1);
  EXPECT_EQ((*scene_.view(exactly(3), kNow))->revision, 3u);
  EXPECT_EQ((*scene_.view(exactly(4), kNow))->revision, 4u);
}

TEST_F(SceneTest, AnotherEpochIsRefusedByEveryView) {
  for (const View::Kind kind : {View::Kind::kLatest, View::Kind::kAtLeast, View::Kind::kExactly})
    expect_refusal(scene_.view({kind, 0, kEpoch + 1}, far_away()).status(), absl::StatusCode::kFailedPrecondition,
                   Reason::kSceneRestarted, "view.epoch");
}

TEST_F(SceneTest, TheSameEpochIsAccepted) { EXPECT_TRUE(scene_.view({View::Kind::kExactly, 0, kEpoch}, kNow).ok()); }

TEST_F(SceneTest, CloseWakesAllWaiters) {
  std::vector<std::thread> waiters;
  for (int i = 0; i < 3; ++i)
    waiters.emplace_back([&] {
      expect_refusal(scene_.view(at_least(1000), far_away()).status(), absl::StatusCode::kNotFound, Reason::kNotFound,
                     "scene");
    });
  tick(1);
  scene_.close();
  for (std::thread& waiter : waiters) waiter.join();
}

TEST_F(SceneTest, AClosedSceneRefusesUpdates) {
  scene_.close();
  expect_refusal(scene_.apply(with(points({1}, {0, 0, 0}))).status(), absl::StatusCode::kNotFound, Reason::kNotFound,
                 "scene");
}

TEST_F(SceneTest, AClosedSceneRefusesStaticChanges) {
  scene_.close();
  expect_refusal(scene_.change_instances(placing(placement({1}, {0, 0, 0}))).status(), absl::StatusCode::kNotFound,
                 Reason::kNotFound, "scene");
  EXPECT_EQ(scene_.status().pending_changes, 0u);
}

TEST_F(SceneTest, AClosedSceneRefusesEveryView) {
  scene_.close();
  expect_refusal(scene_.view({}, kNow).status(), absl::StatusCode::kNotFound, Reason::kNotFound, "scene");
  expect_refusal(scene_.view(exactly(0), kNow).status(), absl::StatusCode::kNotFound, Reason::kNotFound, "scene");
}

TEST_F(SceneTest, ASnapshotOutlivesItsScene) {
  auto scene = std::make_unique<Scene>("brief", SceneSpec{}, 1, StaticSet::empty());
  ASSERT_TRUE(scene->apply(with(points({1}, {4, 0, 0}))).ok());
  const SnapshotPtr snapshot = scene->latest();
  scene.reset();
  EXPECT_EQ(snapshot->objects.find(1)->shape.position.x, 4);
  EXPECT_EQ(snapshot->objects.size(), 1u);
}

TEST_F(SceneTest, WrongFormIsRefusedAndChangesNothing) {
  UpdateBatch batch = with(points({1}, {0, 0, 0}));
  batch.moves.push_back(move_to({1}, {0, 0}));
  expect_refusal(scene_.apply(batch).status(), absl::StatusCode::kInvalidArgument, Reason::kColumnLength,
                 "moves[0].positions");
  EXPECT_EQ(revision(), 0u);
  EXPECT_TRUE(ids().empty());
}

TEST_F(SceneTest, TheLastBuildErrorIsKeptAfterLaterSuccesses) {
  EXPECT_EQ(scene_.status().last_build_error, "");
  EXPECT_FALSE(scene_.change_instances(placing(placement({0}, {0, 0, 0}))).ok());
  EXPECT_TRUE(scene_.change_instances(placing(placement({1}, {0, 0, 0}))).ok());
  EXPECT_NE(scene_.status().last_build_error.find("place[0].ids[0]"), std::string::npos);
}

TEST_F(SceneTest, MemoryIsCountedWithoutMeshes) {
  std::vector<float> vertices;
  std::vector<uint32_t> indices;
  for (uint32_t i = 0; i < 9000; ++i) vertices.push_back(static_cast<float>(i % 97));
  for (uint32_t i = 0; i < 3000; ++i) indices.push_back(i);
  mesh_ = *StaticMesh::build("large", {}, *TriangleMesh::create(vertices, indices, {}));
  ASSERT_TRUE(scene_.change_instances(placing(placement({1}, {0, 0, 0}))).ok());
  EXPECT_GT(scene_.status().memory_bytes, 0u);
  EXPECT_LT(scene_.status().memory_bytes, mesh_->bytes());
  EXPECT_EQ(scene_.status().mesh_bytes, mesh_->bytes());
  ASSERT_TRUE(scene_.change_instances(placing(placement({2, 3}, {0, 0, 0}))).ok());
  EXPECT_EQ(scene_.status().mesh_bytes, mesh_->bytes()) << "a mesh is counted once";
  const std::shared_ptr<const StaticMesh> first = std::exchange(mesh_, StaticMesh::share("alias", {}, *mesh_));
  ASSERT_TRUE(scene_.change_instances(placing(placement({4}, {0, 0, 0}))).ok());
  EXPECT_EQ(scene_.status().mesh_bytes, first->bytes() + mesh_->bytes() - mesh_->shared_bytes());
}

TEST_F(SceneTest, RecentRevisionsAreCountedUntilTheyAreForgotten) {
  EXPECT_EQ(scene_.status().recent_bytes, 0u);
  std::vector<Id> all(1000);
  for (uint64_t i = 0; i < all.size(); ++i) all[i] = i + 1;
  apply(with(points(all, {0, 0, 0})));
  for (int i = 1; i <= 100; ++i) apply(with(move_to(all, {float(i), 0, 0})));
  EXPECT_GT(scene_.status().recent_bytes, limits::kRecentBytes / 2);
  EXPECT_LE(scene_.status().recent_bytes, limits::kRecentBytes);
  scene_.forget_recent();
  EXPECT_EQ(scene_.status().recent_bytes, 0u);
}

}  // namespace
}  // namespace locus::test
