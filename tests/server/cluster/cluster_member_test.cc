// Cluster members with their threads and the real clock over an engine in memory, at full speed: times are a hundredth
// of the product's. On a busy machine members may be declared dead although they live; the rules hold all the same.
#include "server/cluster/cluster_member.h"

#include <gmock/gmock.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "tests/support/engine_link.h"
#include "tests/support/random.h"
#include "tests/support/simulated_engine.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::CallFate;
using test::CallKind;
using test::LeaderChange;
using test::SimulatedEngine;

// The steady clock, because a test may run where the time since boot is simulated.
ClusterTime steady_now() { return std::chrono::steady_clock::now(); }

ClusterTiming fast_timing() {
  ClusterTiming timing;
  for (ClusterTiming::Duration* time :
       {&timing.beat, &timing.jitter, &timing.max_gap, &timing.quiet, &timing.silence, &timing.lease,
        &timing.others_wait, &timing.sweep, &timing.reconcile, &timing.retry, &timing.table_age})
    *time /= 100;
  return timing;
}

// Host that remembers what it leads, and follows all scenes.
class ThreadedHost : public ClusterHost {
 public:
  uint64_t load() override { return leading_.load(); }
  void start_leading(const LedScene& scene) override {
    const MutexLock lock(mutex_);
    wrong_ += led_.emplace(scene.row.key, scene.lease).second ? 0 : 1;
    leading_ = led_.size();
  }
  void stop_leading(SceneKey scene, Token token, StopReason) override {
    const MutexLock lock(mutex_);
    const auto led = led_.find(scene);
    wrong_ += led != led_.end() && led->second->token() == token && !led->second->living() ? 0 : 1;
    led_.erase(scene);
    leading_ = led_.size();
  }
  void leader_changed(const LeaderRow&) override {}
  std::vector<FollowedScene> followed_scenes(MemberId) override { return {}; }
  std::vector<MemberId> caught_up_followers(SceneKey) override {
    const MutexLock lock(mutex_);
    return followers_;
  }

  void set_followers(std::vector<MemberId> followers) {
    const MutexLock lock(mutex_);
    followers_ = std::move(followers);
  }
  std::shared_ptr<const SceneLease> find(SceneKey scene) const {
    const MutexLock lock(mutex_);
    const auto led = led_.find(scene);
    if (led == led_.end()) return nullptr;
    return led->second;
  }
  uint64_t wrong() const { return wrong_.load(); }

 private:
  mutable Mutex mutex_;
  std::map<SceneKey, std::shared_ptr<const SceneLease>> led_ LOCUS_GUARDED_BY(mutex_);
  std::vector<MemberId> followers_ LOCUS_GUARDED_BY(mutex_);
  std::atomic<uint64_t> leading_{0};
  std::atomic<uint64_t> wrong_{0};
};

struct ThreadedDaemon {
  ThreadedDaemon(SimulatedEngine& engine, uint64_t seed)
      : link(
            engine,
            [this](CallKind kind) {
              ++hanging;
              while (kind == CallKind::kBeat ? beats_hang : hangs) std::this_thread::sleep_for(milliseconds(1));
              --hanging;
              return away ? CallFate::kNever : CallFate::kAnswered;
            },
            [](const std::function<void()>&) {}, [](CallKind, CallFate) {}),
        member(std::make_unique<ClusterMember>(link, host,
                                               ClusterMember::Options{{"host", "", ""},
                                                                      fast_timing(),
                                                                      [this] {
                                                                        ++clock_calls;
                                                                        return steady_now();
                                                                      },
                                                                      seed})) {
    member->start();
  }
  std::atomic<bool> away{false};  // cut off from the engine
  std::atomic<bool> beats_hang{false};
  std::atomic<bool> hangs{false};  // calls but beats wait until this is false again
  std::atomic<uint64_t> clock_calls{0};
  std::atomic<uint64_t> hanging{0};  // calls that wait
  test::EngineLink link;
  ThreadedHost host;
  std::unique_ptr<ClusterMember> member;
};

constexpr SceneKey kThreadedScenes = 8;

class ClusterMemberTest : public ::testing::Test {
 protected:
  explicit ClusterMemberTest(uint64_t daemons = 4) {
    engine_.on_leader_change = [this](const LeaderChange& change) {
      const bool moved = change.cause == LeaderChange::Cause::kTakeOver && change.leader_lived;
      wrong_ += moved || change.after.token != change.before.token + 1 ? 1 : 0;
    };
    for (uint64_t number = 0; number < daemons; ++number)
      daemons_.push_back(std::make_unique<ThreadedDaemon>(engine_, ++seed_));
  }
  ~ClusterMemberTest() override {
    for (const auto& daemon : daemons_) {
      if (daemon == nullptr) continue;
      daemon->member->stop();
      EXPECT_EQ(daemon->host.wrong(), 0u);
    }
    EXPECT_EQ(wrong_, 0u);
  }

  void place_all() {
    for (SceneKey key = 1; key <= kThreadedScenes; ++key) engine_.add_scene(key);
    for (SceneKey key = 1; key <= kThreadedScenes; ++key) {
      const auto placed = daemons_[0]->member->place(key);  // fails if no member has joined, or if it was swept before
      EXPECT_NE(placed.status().code(), absl::StatusCode::kNotFound);
    }
  }
  // Returns the daemons whose lease of the scene is living.
  std::vector<ThreadedDaemon*> leaders(SceneKey key) const {
    std::vector<ThreadedDaemon*> living;
    for (const auto& daemon : daemons_) {
      if (daemon == nullptr) continue;
      const auto lease = daemon->host.find(key);
      if (lease != nullptr && lease->living()) living.push_back(daemon.get());
    }
    return living;
  }
  // Waits until the condition holds, at most a minute.
  static bool soon(const std::function<bool()>& condition) {
    const auto deadline = std::chrono::steady_clock::now() + seconds(60);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      std::this_thread::sleep_for(milliseconds(1));
    }
    return true;
  }
  bool all_led() const {
    for (SceneKey key = 1; key <= kThreadedScenes; ++key)
      if (!soon([&] { return !leaders(key).empty(); })) return false;
    return true;
  }

  SimulatedEngine engine_;
  std::atomic<uint64_t> wrong_{0};
  uint64_t seed_ = 0;
  std::vector<std::unique_ptr<ThreadedDaemon>> daemons_;
};

TEST_F(ClusterMemberTest, ScenesArePlacedAndTakenOver) {
  place_all();
  ASSERT_TRUE(all_led());
  daemons_[1] = nullptr;
  daemons_[2] = nullptr;
  EXPECT_TRUE(all_led());
}

TEST_F(ClusterMemberTest, ADrainedDaemonLeadsNothingAndLeaves) {
  place_all();
  ASSERT_TRUE(all_led());
  EXPECT_TRUE(daemons_[0]->member->drain(std::chrono::steady_clock::now() + seconds(60)));
  EXPECT_EQ(daemons_[0]->member->leading(), 0u);
  EXPECT_EQ(daemons_[0]->member->id(), 0u);
  EXPECT_TRUE(all_led());
}

TEST_F(ClusterMemberTest, AMoveIsRefusedInWordsIfTheSceneIsNotLedHere) {
  const absl::Status moved = daemons_[0]->member->move(77, 5, std::chrono::steady_clock::now() + seconds(60));
  EXPECT_EQ(moved.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(moved.message()), ::testing::HasSubstr("this daemon"));
}

TEST_F(ClusterMemberTest, MovesThatWaitEndWhenTheDaemonStops) {
  engine_.add_scene(1);
  ASSERT_TRUE(soon([&] { return !leaders(1).empty(); }));
  ThreadedDaemon& daemon = *leaders(1).front();
  daemon.hangs = true;
  ASSERT_TRUE(soon([&] { return daemon.hanging > 0; }));
  const auto deadline = std::chrono::steady_clock::now() + seconds(60);
  absl::StatusCode code = absl::StatusCode::kOk;
  std::thread mover([&] { code = daemon.member->move(1, 5, deadline).code(); });
  std::this_thread::sleep_for(milliseconds(50));
  std::thread stopper([&] { daemon.member->stop(); });
  std::this_thread::sleep_for(milliseconds(300));  // until it waits for the call that hangs
  daemon.hangs = false;
  stopper.join();
  mover.join();
  EXPECT_EQ(code, absl::StatusCode::kCancelled);
  EXPECT_EQ(daemon.member->move(1, 5, deadline).code(), absl::StatusCode::kCancelled) << "it has stopped";
  EXPECT_LT(std::chrono::steady_clock::now(), deadline);
}

// The silence of the neighbours, who beat no more, is over long ago, but does not count while the own beat hangs.
TEST_F(ClusterMemberTest, AThreadSleepsWhileABeatHangs) {
  ASSERT_TRUE(soon([&] { return engine_.living() == daemons_.size(); }));
  std::this_thread::sleep_for(milliseconds(50));
  for (const auto& daemon : daemons_) daemon->beats_hang = true;
  std::this_thread::sleep_for(milliseconds(200));
  const uint64_t before = daemons_[0]->clock_calls;
  std::this_thread::sleep_for(milliseconds(500));
  const uint64_t calls = daemons_[0]->clock_calls - before;
  for (const auto& daemon : daemons_) daemon->beats_hang = false;
  EXPECT_LT(calls, 600u) << "a step each 10 ms has a few calls";
}

// A host may fence a scene again at once, with the token that the engine still has.
TEST_F(ClusterMemberTest, StartsAndStopsOfASceneAlternateWhileItIsFencedAllTheTime) {
  engine_.add_scene(1);
  ASSERT_TRUE(soon([&] { return !leaders(1).empty(); }));
  ThreadedDaemon& daemon = *leaders(1).front();
  const Token token = engine_.row(1).token;
  std::atomic<bool> done = false;
  std::atomic<uint64_t> fenced = 0;
  std::vector<std::thread> threads;
  for (int number = 0; number < 2; ++number)
    threads.emplace_back([&] {
      while (!done) {
        fenced += daemon.member->fenced(1, token) ? 1 : 0;
        daemon.member->look_soon();
      }
    });
  std::this_thread::sleep_for(seconds(1));
  done = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_GT(fenced, 20u);
  EXPECT_EQ(daemon.host.wrong(), 0u);
}

// Threads that search for scenes with two leaders, until the object is destroyed.
class LeaderWatch {
 public:
  explicit LeaderWatch(const std::vector<std::unique_ptr<ThreadedDaemon>>& daemons) {
    for (int number = 0; number < 2; ++number)
      threads_.emplace_back([this, &daemons] {
        while (!done_)
          for (SceneKey key = 1; key <= kThreadedScenes; ++key) look(daemons, key);
      });
  }
  ~LeaderWatch() {
    done_ = true;
    for (std::thread& thread : threads_) thread.join();
    EXPECT_EQ(two_leaders_, 0u);
  }

 private:
  void look(const std::vector<std::unique_ptr<ThreadedDaemon>>& daemons, SceneKey key) {
    for (const auto& first : daemons) {
      const auto lease = first->host.find(key);
      if (lease == nullptr || !lease->living()) continue;
      for (const auto& second : daemons) {
        const auto other = second->host.find(key);
        // The first one leads before and after the second one does.
        if (second != first && other != nullptr && other->living() && lease->living()) ++two_leaders_;
      }
    }
  }

  std::atomic<bool> done_{false};
  std::atomic<uint64_t> two_leaders_{0};
  std::vector<std::thread> threads_;
};

TEST_F(ClusterMemberTest, ADaemonThatIsCutOffIsDeclaredDeadAndReturns) {
  place_all();
  ASSERT_TRUE(all_led());
  const LeaderWatch watch(daemons_);
  for (int round = 0; round < 5; ++round) {
    ThreadedDaemon& daemon = *daemons_[static_cast<size_t>(round) % daemons_.size()];
    ASSERT_TRUE(soon([&] { return daemon.member->id() != 0; }));
    const MemberId id = daemon.member->id();
    daemon.away = true;
    ASSERT_TRUE(soon([&] { return !engine_.lives(id); }));
    daemon.away = false;
    ASSERT_TRUE(soon([&] { return daemon.member->id() != id && daemon.member->engine_answers(); }));
    EXPECT_TRUE(all_led());
  }
}

// Threads fence, move, and cut daemons off from the engine for short times.
TEST_F(ClusterMemberTest, NoSceneHasTwoLeadersAtFullSpeed) {
  place_all();
  const LeaderWatch watch(daemons_);
  test::Random random(1);
  for (int step = 0; step < 2000; ++step) {
    ThreadedDaemon& daemon = *daemons_[random.below(daemons_.size())];
    const ThreadedDaemon& other = *daemons_[random.below(daemons_.size())];
    const SceneKey key = 1 + random.below(kThreadedScenes);
    switch (random.below(8)) {
      case 0:  // the host may be wrong: then the next comparison with the engine begins to lead again
        if (const auto lease = daemon.host.find(key)) daemon.member->fenced(key, lease->token());
        break;
      case 1:
        daemon.away = random.chance(0.3);
        break;
      case 2:
        daemon.host.set_followers({other.member->id()});
        (void)daemon.member->move(key, other.member->id(), std::chrono::steady_clock::now() + milliseconds(20));
        break;
      case 3:
        daemon.member->look_soon();
        break;
      default:
        std::this_thread::sleep_for(milliseconds(1));
    }
  }
  for (const auto& daemon : daemons_) daemon->away = false;
  EXPECT_TRUE(all_led());
}

}  // namespace
}  // namespace locus::server
