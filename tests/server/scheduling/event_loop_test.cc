#include "server/scheduling/event_loop.h"

#include <gtest/gtest.h>

#include <latch>
#include <list>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

namespace locus::server {
namespace {

using std::chrono::steady_clock;

// Event source that returns tags from a queue. Fails the test if two threads wait in next() at the same time.
class QueueSource final : public EventSource {
 public:
  void put(EventTag& tag) {
    const std::lock_guard lock(mutex_);
    tags_.push_back(&tag);
    changed_.notify_one();
  }
  void end() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_one();
  }
  Next next(steady_clock::duration wait, EventTag** tag, bool* ok) override {
    EXPECT_FALSE(inside_.exchange(true)) << "two leaders";
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, wait, [this] { return !tags_.empty() || ended_ || interrupted_; });
    interrupted_ = false;
    inside_.store(false);
    if (tags_.empty()) return ended_ ? Next::kEnd : Next::kNothing;
    *tag = tags_.front();
    *ok = true;
    tags_.pop_front();
    return Next::kEvent;
  }
  void interrupt() override {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
    changed_.notify_one();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<EventTag*> tags_;
  bool ended_ = false;
  bool interrupted_ = false;
  std::atomic<bool> inside_{false};
};

class Call final : public EventTag {
 public:
  explicit Call(std::function<void()> then) : then_(std::move(then)) {}
  void arrived(bool) override { then_(); }

 private:
  std::function<void()> then_;
};

class Work final : public DeferredTask {
 public:
  Work(std::function<void()> run, std::function<void()> done) : run_(std::move(run)), done_(std::move(done)) {}
  void run_deferred() override { run_(); }
  void on_deferred_done() override { done_(); }

 private:
  std::function<void()> run_, done_;
};

// Event loop with `threads` threads that run its turns until the destructor.
class Served {
 public:
  explicit Served(size_t threads) {
    for (size_t i = 0; i < threads; ++i)
      threads_.emplace_back([this] {
        while (loop.turn()) {
        }
      });
  }
  ~Served() {
    source.end();
    for (std::thread& thread : threads_) thread.join();
  }

  QueueSource source;
  EventLoop loop{source};

 private:
  std::vector<std::thread> threads_;
};

TEST(EventLoopTest, PostedTagsArriveInOrderWhileTheLeaderSleeps) {
  std::vector<int> order;
  std::latch all(3);
  Served served(2);
  Call first([&] { order.push_back(1), all.count_down(); });
  Call second([&] { order.push_back(2), all.count_down(); });
  Call third([&] { order.push_back(3), all.count_down(); });
  for (Call* call : {&first, &second, &third}) served.loop.post(*call);
  all.wait();
  EXPECT_EQ(order, (std::vector<int>{1, 2, 3}));
}

TEST(EventLoopTest, ALongDeferredTaskHandsTheLeadToAnotherThread) {
  std::latch meet(2), all(2);
  // Each of the two tasks waits for the other, so if both ran on one thread, neither would end.
  const auto run = [&meet] { meet.arrive_and_wait(); };
  Work one(run, [&all] { all.count_down(); }), other(run, [&all] { all.count_down(); });
  Served served(2);
  Call first([&] { served.loop.defer(one, TaskLength::kLong); });
  Call second([&] { served.loop.defer(other, TaskLength::kLong); });
  served.source.put(first);
  served.source.put(second);
  all.wait();
}

TEST(EventLoopTest, EventsWaitWhileEveryThreadRunsALongTask) {
  std::latch begun(2), go(1), all(3);
  const auto run = [&] {
    begun.count_down();
    go.wait();
  };
  Work one(run, [&all] { all.count_down(); }), other(run, [&all] { all.count_down(); });
  std::atomic<bool> arrived{false};
  Served served(2);
  Call first([&] { served.loop.defer(one, TaskLength::kLong); });
  Call second([&] { served.loop.defer(other, TaskLength::kLong); });
  Call third([&] { arrived = true, all.count_down(); });
  served.source.put(first);
  served.source.put(second);
  begun.wait();
  served.source.put(third);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(arrived);
  go.count_down();
  all.wait();
}

TEST(EventLoopTest, AShortDeferredTaskKeepsTheLead) {
  std::latch begun(1), go(1), all(2);
  Work work(
      [&] {
        begun.count_down();
        go.wait();
      },
      [&all] { all.count_down(); });
  std::atomic<bool> arrived{false};
  Served served(2);
  Call first([&] { served.loop.defer(work, TaskLength::kShort); });
  Call second([&] { arrived = true, all.count_down(); });
  served.source.put(first);
  begun.wait();
  served.source.put(second);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(arrived) << "no thread leads meanwhile";
  go.count_down();
  all.wait();
}

TEST(EventLoopTest, ATimerSetByAnotherThreadWakesTheLeader) {
  std::latch rung(1);
  Served served(2);
  Work work([] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); },
            [&] { served.loop.at(steady_clock::now(), [&rung] { rung.count_down(); }); });
  Call first([&] { served.loop.defer(work, TaskLength::kLong); });
  served.source.put(first);
  rung.wait();
}

TEST(EventLoopTest, ACancelledTimerIsNotCalled) {
  std::latch all(1);
  bool called = false;
  Served served(1);
  Call first([&] {
    const auto soon = served.loop.at(steady_clock::now() + std::chrono::milliseconds(5), [&called] { called = true; });
    served.loop.at(steady_clock::now() + std::chrono::milliseconds(30), [&all] { all.count_down(); });
    served.loop.cancel(soon);
  });
  served.source.put(first);
  all.wait();
  EXPECT_FALSE(called);
}

TEST(EventLoopTest, TheEndOfTheSourceStopsEveryThread) {
  Served served(4);
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

// Handlers change `shared` without a lock, so ThreadSanitizer would report handlers that run concurrently. The final
// count shows that every event and every task is handled once.
TEST(EventLoopTest, HandlersNeverRunConcurrentlyAndNoEventIsLost) {
  constexpr uint64_t kChains = 24, kSteps = 400;
  uint64_t shared = 0;  // data shared by handlers
  std::atomic<uint64_t> worked{0};
  std::latch all(kChains);
  Served served(3);

  // Chain of kSteps events. Each event causes the next in a randomly chosen way: by the source, a post, a timer, or a
  // deferred task.
  struct Chain {
    Chain(uint64_t number, Served& with, uint64_t& count, std::atomic<uint64_t>& works, std::latch& end)
        : served(with),
          random(number),
          step([this, &count, &end] {
            ++count;
            if (++steps == kSteps) return end.count_down();
            go_on();
          }),
          work([&works] { ++works; },
               [this, &count] {
                 ++count;
                 served.source.put(step);
               }) {}
    void go_on() {
      switch (random() % 4) {
        case 0:
          return served.source.put(step);
        case 1:
          return served.loop.post(step);
        case 2:
          served.loop.at(steady_clock::now() + std::chrono::microseconds(random() % 50),
                         [this] { step.arrived(true); });
          return;
        default:
          return served.loop.defer(work, random() % 2 == 0 ? TaskLength::kShort : TaskLength::kLong);
      }
    }
    Served& served;
    std::mt19937 random;
    uint64_t steps = 0;
    Call step;
    Work work;
  };
  std::list<Chain> chains;
  for (uint64_t i = 0; i < kChains; ++i) chains.emplace_back(i, served, shared, worked, all);
  std::vector<std::thread> posters;
  for (Chain& chain : chains) posters.emplace_back([&chain] { chain.served.loop.post(chain.step); });
  for (std::thread& poster : posters) poster.join();
  all.wait();
  std::latch seen(1);
  uint64_t counted = 0;
  Call look([&] { counted = shared, seen.count_down(); });
  served.loop.post(look);
  seen.wait();
  EXPECT_EQ(counted, kChains * kSteps + worked);
}

}  // namespace
}  // namespace locus::server
