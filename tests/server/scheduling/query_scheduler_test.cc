#include "server/scheduling/query_scheduler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <thread>
#include <vector>

#include "core/base/mutex.h"
#include "core/base/refusal.h"

namespace locus::server {
namespace {

using testing::HasSubstr;

constexpr uint64_t kSchedulerTurn = 100'000;
constexpr uint64_t kSmall = 200'000, kLarge = 2'000'000;

// Clock of this thread, in nanoseconds; it advances only while a job works on this thread.
thread_local uint64_t worked_here = 0;

SchedulerOptions options_of(uint32_t threads) {
  SchedulerOptions options;
  options.threads = threads;
  options.turn_nanoseconds = kSchedulerTurn;
  options.clock = [] { return worked_here; };
  return options;
}

// List of the clients of all turns, in the order of the turns.
class Book {
 public:
  void add(uint64_t client) {
    const MutexLock lock(mutex_);
    turns_.push_back(client);
  }
  std::vector<uint64_t> turns() const {
    const MutexLock lock(mutex_);
    return turns_;
  }

 private:
  mutable Mutex mutex_;
  std::vector<uint64_t> turns_ LOCUS_GUARDED_BY(mutex_);
};

// Job of `turns` turns. Any number of threads may run turns at the same time.
class TurnsJob final : public QueryJob {
 public:
  TurnsJob(uint32_t turns, uint64_t client = 0, Book* book = nullptr) : turns_(turns), client_(client), book_(book) {}

  Progress work(uint64_t nanoseconds) override {
    ++inside_;
    const uint32_t turn = begun_.fetch_add(1);
    if (turn >= turns_) {
      --inside_;
      return Progress::kBegun;
    }
    if (book_ != nullptr) book_->add(client_);
    worked_here += nanoseconds;
    if (hold_ != nullptr && turn == held_turn_)
      while (hold_->load()) std::this_thread::yield();
    max_inside_ = std::max(max_inside_.load(), inside_.load());
    --inside_;
    if (ended_.fetch_add(1) + 1 == turns_) return Progress::kDone;
    return turn + 1 < turns_ ? Progress::kMore : Progress::kBegun;
  }
  void done() override {
    EXPECT_EQ(inside_.load(), 0u) << "done while a thread works";
    done_.fetch_add(1);
  }

  // Makes the turn with index `turn` wait while `*hold` is true.
  void hold(std::atomic<bool>* hold, uint32_t turn = 0) {
    hold_ = hold;
    held_turn_ = turn;
  }
  uint32_t done_count() const { return done_.load(); }
  bool begun() const { return begun_.load() > 0; }
  void wait() const {
    while (done_.load() == 0) std::this_thread::yield();
  }

 private:
  const uint32_t turns_;
  const uint64_t client_;
  Book* const book_;
  std::atomic<bool>* hold_ = nullptr;
  uint32_t held_turn_ = 0;
  std::atomic<uint32_t> begun_{0}, ended_{0}, inside_{0}, max_inside_{0}, done_{0};
};

// Keeps the only thread of a scheduler busy until release().
class Blocker {
 public:
  explicit Blocker(QueryScheduler& scheduler) : job_(1) {
    job_.hold(&held_);
    EXPECT_TRUE(scheduler.submit(job_, 999, kSmall).ok());
    while (!job_.begun()) std::this_thread::yield();
  }
  ~Blocker() {
    release();
    job_.wait();
  }
  void release() { held_ = false; }

 private:
  std::atomic<bool> held_{true};
  TurnsJob job_;
};

TEST(QuerySchedulerTest, EveryJobIsDoneExactlyOnce) {
  std::vector<std::unique_ptr<TurnsJob>> jobs;
  for (uint32_t i = 0; i < 200; ++i) jobs.push_back(std::make_unique<TurnsJob>(1 + i % 17));
  {
    QueryScheduler scheduler(options_of(4));
    std::vector<std::thread> callers;
    for (uint32_t caller = 0; caller < 4; ++caller)
      callers.emplace_back([&, caller] {
        for (uint32_t i = caller; i < jobs.size(); i += 4) {
          const auto ticket = scheduler.submit(*jobs[i], i % 5, i % 3 == 0 ? kLarge : kSmall);
          EXPECT_TRUE(ticket.ok());
        }
      });
    for (std::thread& caller : callers) caller.join();
  }
  for (const auto& job : jobs) EXPECT_EQ(job->done_count(), 1u);
}

TEST(QuerySchedulerTest, AJobEstimatedUnderTheBudgetIsRunByItsCallerAndNeverQueued) {
  QueryScheduler scheduler(options_of(1));
  TurnsJob job(1);
  EXPECT_TRUE(scheduler.runs_inline(scheduler.options().inline_nanoseconds - 1));
  EXPECT_FALSE(scheduler.runs_inline(scheduler.options().inline_nanoseconds));
  EXPECT_EQ(scheduler.run_inline(job), Progress::kDone);
  EXPECT_EQ(job.done_count(), 0u) << "the caller knows";
  EXPECT_EQ(scheduler.stats().inline_done, 1u);
  EXPECT_EQ(scheduler.stats().worked_nanoseconds, 0u);
}

TEST(QuerySchedulerTest, TheRestOfAnInlineRunCanBeQueued) {
  QueryScheduler scheduler(options_of(1));
  TurnsJob job(5);
  EXPECT_EQ(scheduler.run_inline(job), Progress::kMore);
  ASSERT_TRUE(scheduler.submit(job, 1, kSchedulerTurn / 2).ok());
  job.wait();
  EXPECT_EQ(scheduler.stats().inline_done, 0u);
}

// The scheduler has one thread, and the jobs of two clients wait. Turns alternate between the clients, however many
// jobs each client has.
TEST(QuerySchedulerTest, AClientWithAHundredJobsDelaysAnotherByNoMoreThanItsShare) {
  Book book;
  std::vector<std::unique_ptr<TurnsJob>> jobs;
  QueryScheduler scheduler(options_of(1));
  {
    Blocker blocker(scheduler);
    for (int i = 0; i < 100; ++i) {
      jobs.push_back(std::make_unique<TurnsJob>(10, 1, &book));
      ASSERT_TRUE(scheduler.submit(*jobs.back(), 1, kLarge).ok());
    }
    jobs.push_back(std::make_unique<TurnsJob>(10, 2, &book));
    ASSERT_TRUE(scheduler.submit(*jobs.back(), 2, kLarge).ok());
  }
  for (const auto& job : jobs) job->wait();
  const std::vector<uint64_t> turns = book.turns();
  const auto last_of_two = std::find(turns.rbegin(), turns.rend(), 2).base() - turns.begin();
  EXPECT_LE(last_of_two, 21) << "of 1010 turns";
  EXPECT_EQ(std::count(turns.begin(), turns.begin() + last_of_two, 2), 10);
}

TEST(QuerySchedulerTest, SmallJobsGoBeforeLargeOnesThatCameEarlier) {
  Book book;
  TurnsJob large(20, 1, &book), small(2, 2, &book);
  QueryScheduler scheduler(options_of(1));
  {
    Blocker blocker(scheduler);
    ASSERT_TRUE(scheduler.submit(large, 1, kLarge).ok());
    ASSERT_TRUE(scheduler.submit(small, 2, kSmall).ok());
  }
  large.wait();
  small.wait();
  const std::vector<uint64_t> turns = book.turns();
  EXPECT_EQ(std::find(turns.rbegin(), turns.rend(), 2).base() - turns.begin(), 2);
}

TEST(QuerySchedulerTest, LargeJobsGetAFifthOfTheWorkWhileSmallOnesNeverEnd) {
  Book book;
  std::vector<std::unique_ptr<TurnsJob>> jobs;
  QueryScheduler scheduler(options_of(1));
  {
    Blocker blocker(scheduler);
    jobs.push_back(std::make_unique<TurnsJob>(100, 1, &book));
    ASSERT_TRUE(scheduler.submit(*jobs.back(), 1, kLarge).ok());
    for (int i = 0; i < 400; ++i) {
      jobs.push_back(std::make_unique<TurnsJob>(1, 2, &book));
      ASSERT_TRUE(scheduler.submit(*jobs.back(), 2, kSmall / 2).ok());
    }
  }
  for (const auto& job : jobs) job->wait();
  const std::vector<uint64_t> turns = book.turns();
  const auto large = std::count(turns.begin(), turns.begin() + 100, 1);
  EXPECT_GE(large, 19);
  EXPECT_LE(large, 21);
}

TEST(QuerySchedulerTest, AJobThatTurnsOutLargeGivesWayToSmallOnes) {
  Book book;
  TurnsJob sly(100, 1, &book), honest(1, 2, &book);
  QueryScheduler scheduler(options_of(1));
  std::atomic<bool> held{true};
  sly.hold(&held, 20);
  ASSERT_TRUE(scheduler.submit(sly, 1, kSmall).ok());
  while (book.turns().size() < 21) std::this_thread::yield();
  ASSERT_TRUE(scheduler.submit(honest, 1, kSmall).ok());
  held = false;
  honest.wait();
  sly.wait();
  const std::vector<uint64_t> turns = book.turns();
  EXPECT_LE(std::find(turns.begin(), turns.end(), 2) - turns.begin(), 22) << "queued behind it, it would come last";
}

TEST(QuerySchedulerTest, SeveralThreadsWorkOnOneJob) {
  QueryScheduler scheduler(options_of(3));
  std::atomic<uint32_t> here{0};
  // Job of three turns, each of which waits until three threads are working on the job.
  class Meeting final : public QueryJob {
   public:
    explicit Meeting(std::atomic<uint32_t>& here) : here_(here) {}
    Progress work(uint64_t) override {
      const uint32_t turn = begun_.fetch_add(1);
      if (turn >= 3) return Progress::kBegun;
      ++here_;
      while (here_ < 3) std::this_thread::yield();
      return ended_.fetch_add(1) + 1 == 3 ? Progress::kDone : Progress::kMore;
    }
    void done() override { done_ = true; }
    void wait() const {
      while (!done_) std::this_thread::yield();
    }

   private:
    std::atomic<uint32_t>& here_;
    std::atomic<uint32_t> begun_{0}, ended_{0};
    std::atomic<bool> done_{false};
  } job(here);
  ASSERT_TRUE(scheduler.submit(job, 1, kLarge).ok());
  job.wait();
  EXPECT_EQ(here, 3u);
}

TEST(QuerySchedulerTest, AWaitingJobIsWithdrawnAtOnceAndNeverTouchedAgain) {
  QueryScheduler scheduler(options_of(1));
  Blocker blocker(scheduler);
  auto job = std::make_unique<TurnsJob>(1);
  const auto ticket = scheduler.submit(*job, 1, kLarge);
  ASSERT_TRUE(ticket.ok());
  EXPECT_EQ(scheduler.stats().jobs[1], 1u);
  EXPECT_TRUE(scheduler.withdraw(**ticket));
  EXPECT_FALSE(job->begun());
  job.reset();
  EXPECT_EQ(scheduler.stats().jobs[1], 0u);
  EXPECT_EQ(scheduler.stats().nanoseconds[1], 0u);
  EXPECT_EQ(scheduler.stats().withdrawn[1], 1u);
  EXPECT_FALSE(scheduler.withdraw(**ticket)) << "once";
}

TEST(QuerySchedulerTest, ARunningJobIsNotWithdrawnButDone) {
  QueryScheduler scheduler(options_of(1));
  TurnsJob job(1);
  std::atomic<bool> held{true};
  job.hold(&held);
  const auto ticket = scheduler.submit(job, 1, kLarge);
  while (!job.begun()) std::this_thread::yield();
  EXPECT_FALSE(scheduler.withdraw(**ticket));
  held = false;
  job.wait();
  EXPECT_FALSE(scheduler.withdraw(**ticket)) << "done by now";
}

TEST(QuerySchedulerTest, WithdrawnJobsFreeTheirPlaceInTheQueue) {
  SchedulerOptions options = options_of(1);
  options.limits[1].jobs = 2;
  QueryScheduler scheduler(options);
  Blocker blocker(scheduler);
  for (int i = 0; i < 5'000; ++i) {
    TurnsJob job(1);
    const auto ticket = scheduler.submit(job, static_cast<uint64_t>(i), kLarge);
    ASSERT_TRUE(ticket.ok());
    ASSERT_TRUE(scheduler.withdraw(**ticket));
  }
}

TEST(QuerySchedulerTest, WithdrawingRacesWithTheWork) {
  QueryScheduler scheduler(options_of(2));
  uint32_t withdrawn = 0;
  for (uint32_t i = 0; i < 2'000; ++i) {
    TurnsJob job(3);
    const auto ticket = scheduler.submit(job, i % 3, kLarge);
    ASSERT_TRUE(ticket.ok());
    if (scheduler.withdraw(**ticket))
      ++withdrawn;
    else
      job.wait();
    ASSERT_LE(job.done_count(), 1u);
  }
  EXPECT_EQ(scheduler.stats().withdrawn[1], withdrawn);
}

TEST(QuerySchedulerTest, TooManyJobsOfAClassAreRefusedAtOnceNamingTheLimit) {
  SchedulerOptions options = options_of(1);
  options.limits[1].jobs = 2;
  QueryScheduler scheduler(options);
  Blocker blocker(scheduler);
  TurnsJob first(1), second(1), third(1), small(1);
  ASSERT_TRUE(scheduler.submit(first, 1, kLarge).ok());
  ASSERT_TRUE(scheduler.submit(second, 1, kLarge).ok());
  const auto refused = scheduler.submit(third, 2, kLarge);
  ASSERT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  const auto refusal = refusal_of(refused.status());
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->limit, "large_batches");
  EXPECT_EQ(refusal->limit_value, 2);
  EXPECT_EQ(refusal->asked, 3);
  EXPECT_GE(refusal->retry_after_ms, 1u);
  EXPECT_TRUE(scheduler.submit(small, 2, kSmall).ok()) << "the other class has room";
  EXPECT_EQ(scheduler.stats().refused_jobs[1], 1u);
  blocker.release();
  first.wait();
  second.wait();
  small.wait();
  EXPECT_FALSE(third.begun());
}

TEST(QuerySchedulerTest, TooMuchEstimatedWorkIsRefusedWithARetryAfterHalfOfItIsDone) {
  SchedulerOptions options = options_of(1);
  options.limits[1].nanoseconds = 300'000'000;
  QueryScheduler scheduler(options);
  Blocker blocker(scheduler);
  TurnsJob first(1), second(1);
  ASSERT_TRUE(scheduler.submit(first, 1, 200'000'000).ok());
  const auto refused = scheduler.submit(second, 1, 200'000'000);
  const auto refusal = refusal_of(refused.status());
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->limit, "large_batch_work_ms");
  EXPECT_EQ(refusal->limit_value, 300);
  EXPECT_EQ(refusal->asked, 400);
  EXPECT_GE(refusal->retry_after_ms, 100u);
  EXPECT_LE(refusal->retry_after_ms, 201u);
  EXPECT_EQ(scheduler.stats().refused_work[1], 1u);
  blocker.release();
  first.wait();
}

TEST(QuerySchedulerTest, OneJobIsAdmittedHoweverLargeItIs) {
  QueryScheduler scheduler(options_of(1));
  TurnsJob job(3);
  ASSERT_TRUE(scheduler.submit(job, 1, 1'000'000'000'000).ok());
  job.wait();
}

TEST(QuerySchedulerTest, BothClassesTogetherHaveALimitToo) {
  SchedulerOptions options = options_of(1);
  options.limit.jobs = 2;
  QueryScheduler scheduler(options);
  Blocker blocker(scheduler);  // takes one of the two permitted jobs
  TurnsJob second(1), third(1);
  ASSERT_TRUE(scheduler.submit(second, 1, kLarge).ok());
  EXPECT_EQ(refusal_of(scheduler.submit(third, 1, kSmall).status())->limit, "batches");
  EXPECT_THAT(std::string(scheduler.submit(third, 1, kSmall).status().message()), HasSubstr("batches"));
  blocker.release();
  second.wait();
}

}  // namespace
}  // namespace locus::server
