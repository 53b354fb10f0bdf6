#include "server/storage/postgres/append_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <set>
#include <thread>

#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

// Appends of several threads while the first commit is held, so that they wait together.
class HeldAppends {
 public:
  explicit HeldAppends(size_t committers)
      : queue_(committers, [this](absl::Span<Append* const> group) {
          std::vector<SceneKey> scenes;
          for (Append* const append : group) {
            scenes.push_back(append->scene);
            append->outcome = Append::Outcome::kWritten;
          }
          MutexLock lock(mutex_);
          for (Append* const append : group) {
            if (append->scene != blocked_ || blocked_times_ == 0) continue;
            --blocked_times_;
            append->outcome = Append::Outcome::kBlocked;
          }
          groups_.push_back(scenes);
          while (held_) changed_.wait(mutex_);
        }) {}
  ~HeldAppends() { release(); }

  // Lets the next commits of a scene fail because the scene is locked.
  void block(SceneKey scene, int times) {
    MutexLock lock(mutex_);
    blocked_ = scene;
    blocked_times_ = times;
  }
  void start(SceneKey scene, uint64_t bytes) {
    threads_.emplace_back([this, scene, bytes] {
      Append append;
      append.scene = scene;
      append.bytes = bytes;
      queue_.run(append);
      if (append.outcome == Append::Outcome::kWritten) ++written_;
    });
  }
  void wait_for_groups(size_t count) {
    while (true) {
      {
        MutexLock lock(mutex_);
        if (groups_.size() >= count) return;
      }
      std::this_thread::yield();
    }
  }
  // Ends the hold and returns all groups, once all appends have returned.
  std::vector<std::vector<SceneKey>> release() {
    {
      MutexLock lock(mutex_);
      held_ = false;
      changed_.notify_all();
    }
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
    MutexLock lock(mutex_);
    return groups_;
  }
  size_t written() const { return written_; }

 private:
  Mutex mutex_;
  ConditionVariable changed_;
  bool held_ = true;
  SceneKey blocked_ = 0;
  int blocked_times_ = 0;
  std::vector<std::vector<SceneKey>> groups_;
  std::atomic<size_t> written_ = 0;
  AppendQueue queue_;
  std::vector<std::thread> threads_;
};

void let_wait() { std::this_thread::sleep_for(std::chrono::milliseconds(200)); }

TEST(AppendQueueTest, AppendsThatWaitShareOneGroupInOrderOfScene) {
  HeldAppends appends(1);
  appends.start(50, 10);
  appends.wait_for_groups(1);
  for (const SceneKey scene : {7, 3, 9, 1}) appends.start(scene, 10);
  let_wait();
  EXPECT_EQ(appends.release(), (std::vector<std::vector<SceneKey>>{{50}, {1, 3, 7, 9}}));
  EXPECT_EQ(appends.written(), 5u);
}

TEST(AppendQueueTest, ABlockedAppendIsCommittedAgainAloneAndAfterTheOthers) {
  HeldAppends appends(1);
  appends.block(3, 2);
  appends.start(50, 10);
  appends.wait_for_groups(1);
  for (const SceneKey scene : {7, 3}) appends.start(scene, 10);
  let_wait();
  EXPECT_EQ(appends.release(), (std::vector<std::vector<SceneKey>>{{50}, {3, 7}, {3}, {3}}));
  EXPECT_EQ(appends.written(), 3u);
}

TEST(AppendQueueTest, AGroupHasAtMostEightMebibytes) {
  HeldAppends appends(1);
  appends.start(1, 1);
  appends.wait_for_groups(1);
  for (SceneKey scene = 2; scene < 8; ++scene) appends.start(scene, uint64_t{3} << 20);
  let_wait();
  for (const auto& group : appends.release()) EXPECT_LE(group.size(), 2u);
  EXPECT_EQ(appends.written(), 7u);
}

TEST(AppendQueueTest, ALargeAppendIsAGroupOfItsOwn) {
  HeldAppends appends(1);
  appends.start(1, 1);
  appends.wait_for_groups(1);
  appends.start(2, uint64_t{100} << 20);
  let_wait();
  appends.start(3, 1);
  let_wait();
  EXPECT_EQ(appends.release(), (std::vector<std::vector<SceneKey>>{{1}, {2}, {3}}));
}

TEST(AppendQueueTest, AsManyGroupsAsCommittersAreCommittedAtOnce) {
  HeldAppends appends(2);
  appends.start(1, 1);
  appends.wait_for_groups(1);
  appends.start(2, 1);
  appends.wait_for_groups(2);
  appends.start(3, 1);
  let_wait();
  EXPECT_EQ(appends.release(), (std::vector<std::vector<SceneKey>>{{1}, {2}, {3}}));
}

// Runs threads at full speed; each has scenes of its own. No group may have a scene twice, every append is committed
// once, and no more groups than committers overlap.
TEST(AppendQueueTest, EveryAppendIsCommittedOnceAtFullSpeed) {
  constexpr size_t kThreads = 8, kCommitters = 2;
  const uint64_t rounds = test::scaled_count(20'000);
  std::atomic<size_t> inside = 0;
  std::atomic<uint64_t> committed = 0, groups = 0, faults = 0;
  AppendQueue queue(kCommitters, [&](absl::Span<Append* const> group) {
    if (++inside > kCommitters) ++faults;
    ++groups;
    std::set<SceneKey> scenes;
    for (Append* const append : group) {
      if (!scenes.insert(append->scene).second) ++faults;
      if (append->outcome != Append::Outcome::kNotWritten) ++faults;
      append->outcome = Append::Outcome::kWritten;
      ++committed;
    }
    --inside;
  });
  std::vector<std::thread> threads;
  for (SceneKey scene = 1; scene <= kThreads; ++scene)
    threads.emplace_back([&, scene] {
      for (uint64_t round = 0; round < rounds; ++round) {
        Append append;
        append.scene = scene;
        append.bytes = 1;
        queue.run(append);
        if (append.outcome != Append::Outcome::kWritten) ++faults;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(committed, kThreads * rounds);
  EXPECT_LE(groups, committed);
  EXPECT_EQ(faults, 0u);
}

}  // namespace
}  // namespace locus::server
