#include "server/scheduling/lifetime_keeper.h"

#include <gmock/gmock.h>

#include <atomic>
#include <latch>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Time = LifetimeKeeper::Time;

// A keeper without a thread, on a clock that the test sets.
class LifetimeKeeperTest : public ::testing::Test {
 protected:
  static Time at(int64_t ms) { return Time(seconds(1000) + milliseconds(ms)); }

  // Returns a task that records its calls under `name` and always returns `next`.
  LifetimeKeeper::Task task(const std::string& name, std::optional<Time> next = std::nullopt) {
    return [this, name, next](Time) {
      called_.push_back(name);
      return next;
    };
  }
  // Sets the clock and returns the names of the tasks that are called.
  std::vector<std::string> calls_at(int64_t ms) {
    now_ = at(ms);
    called_.clear();
    keeper_.run_due();
    return called_;
  }

  Time now_ = at(0);
  LifetimeKeeper keeper_{[this] { return now_; }};
  std::vector<std::string> called_;
};

TEST_F(LifetimeKeeperTest, TasksAreCalledAtTheirTimesInOrder) {
  keeper_.add(at(30), task("third"));
  keeper_.add(at(10), task("first"));
  keeper_.add(at(20), task("second"));
  EXPECT_THAT(calls_at(9), IsEmpty());
  EXPECT_THAT(calls_at(10), ElementsAre("first"));
  EXPECT_THAT(calls_at(35), ElementsAre("second", "third"));
  EXPECT_EQ(keeper_.size(), 0u);
}

TEST_F(LifetimeKeeperTest, ATaskIsCalledAgainAtTheTimeThatItReturns) {
  keeper_.add(at(10), task("again", at(50)));
  EXPECT_THAT(calls_at(10), ElementsAre("again"));
  EXPECT_THAT(calls_at(49), IsEmpty());
  EXPECT_THAT(calls_at(50), ElementsAre("again"));
}

TEST_F(LifetimeKeeperTest, ATaskThatReturnsAPastTimeIsCalledOnceARound) {
  keeper_.add(at(10), task("late", at(0)));
  EXPECT_THAT(calls_at(10), ElementsAre("late"));
  EXPECT_THAT(calls_at(10), IsEmpty());
  EXPECT_THAT(calls_at(11), ElementsAre("late"));
}

TEST_F(LifetimeKeeperTest, ARemovedTaskIsNotCalled) {
  const LifetimeKeeper::TaskId first = keeper_.add(at(10), task("first"));
  keeper_.add(at(10), [this, first](Time) {
    keeper_.remove(first);
    return std::nullopt;
  });
  const LifetimeKeeper::TaskId third = keeper_.add(at(10), task("third"));
  keeper_.remove(third);
  keeper_.remove(third);
  EXPECT_THAT(calls_at(10), ElementsAre("first"));
  EXPECT_EQ(keeper_.size(), 0u);
}

TEST_F(LifetimeKeeperTest, ATaskMayRemoveItself) {
  LifetimeKeeper::TaskId id = 0;
  id = keeper_.add(at(10), [&](Time) -> std::optional<Time> {
    called_.push_back("once");
    keeper_.remove(id);
    return at(11);
  });
  EXPECT_THAT(calls_at(10), ElementsAre("once"));
  EXPECT_THAT(calls_at(20), IsEmpty());
}

TEST_F(LifetimeKeeperTest, AnExpeditedTaskIsCalledEarlierAndNeverLater) {
  const LifetimeKeeper::TaskId id = keeper_.add(at(100), task("task"));
  keeper_.expedite(id, at(200));
  keeper_.expedite(id, at(50));
  EXPECT_THAT(calls_at(49), IsEmpty());
  EXPECT_THAT(calls_at(50), ElementsAre("task"));
  keeper_.expedite(id, at(60));
  EXPECT_THAT(calls_at(60), IsEmpty()) << "the task has ended";
}

TEST_F(LifetimeKeeperTest, ATaskThatIsExpeditedWhileItRunsIsCalledAgainInTime) {
  LifetimeKeeper::TaskId id = 0;
  id = keeper_.add(at(10), [&](Time) -> std::optional<Time> {
    called_.push_back("task");
    keeper_.expedite(id, at(20));
    return at(1000);
  });
  EXPECT_THAT(calls_at(10), ElementsAre("task"));
  EXPECT_THAT(calls_at(20), ElementsAre("task"));
}

TEST_F(LifetimeKeeperTest, AStoppedKeeperCallsNothing) {
  keeper_.add(at(10), task("task"));
  keeper_.stop();
  EXPECT_THAT(calls_at(10), IsEmpty());
}

// The thread calls a due task without being asked, and an expedited task although it slept until a later time.
TEST(LifetimeKeeperThreadTest, TheThreadWakesForTasks) {
  LifetimeKeeper keeper;
  std::latch called(2);
  keeper.start();
  keeper.add(keeper.now(), [&](Time) {
    called.count_down();
    return std::nullopt;
  });
  const LifetimeKeeper::TaskId late = keeper.add(Time::max(), [&](Time) {
    called.count_down();
    return std::nullopt;
  });
  keeper.expedite(late, keeper.now());
  called.wait();
}

// At full speed: several threads add, expedite and remove tasks while the thread calls them. Each task is called at
// least once unless it is removed, never at the same time as another one, and never after it has ended.
TEST(LifetimeKeeperThreadTest, TasksOfManyThreadsAreCalledOneAtATime) {
  constexpr int kThreads = 3;
  const uint64_t tasks = test::scaled_count(300);
  std::atomic<int> running{0};
  std::atomic<uint64_t> wrong{0};
  LifetimeKeeper keeper;
  keeper.start();
  std::vector<std::thread> threads;
  for (int number = 0; number < kThreads; ++number)
    threads.emplace_back([&, number] {
      test::Random random(static_cast<uint64_t>(number) + 1);
      for (uint64_t i = 0; i < tasks; ++i) {
        struct Life {
          std::atomic<int> calls{0};
          std::latch ended{1};
        };
        const auto life = std::make_shared<Life>();
        const LifetimeKeeper::TaskId id =
            keeper.add(random.below(2) == 0 ? keeper.now() : Time::max(), [&, life](Time now) -> std::optional<Time> {
              wrong += running.fetch_add(1) != 0 || life->calls.load() > 1;
              running.fetch_sub(1);
              if (life->calls.fetch_add(1) == 0) return now;
              life->ended.count_down();
              return std::nullopt;
            });
        if (random.below(4) == 0) {
          keeper.remove(id);
        } else {
          keeper.expedite(id, keeper.now());
          if (random.below(4) == 0) {
            while (!life->ended.try_wait()) {
              keeper.expedite(id, keeper.now());
              std::this_thread::yield();
            }
          }
        }
      }
    });
  for (std::thread& thread : threads) thread.join();
  keeper.stop();
  EXPECT_EQ(wrong.load(), 0u);
}

}  // namespace
}  // namespace locus::server
