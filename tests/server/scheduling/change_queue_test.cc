#include "server/scheduling/change_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <vector>

#include "core/base/refusal.h"

namespace locus::server {
namespace {

TEST(ChangeQueueTest, JobsOfOneKeyRunInTheOrderOfTheirNumbers) {
  constexpr uint64_t kJobs = 200;
  std::vector<uint64_t> order;
  std::promise<void> done;
  ChangeQueue queue(3, kJobs);
  for (uint64_t i = 1; i <= kJobs; ++i) {
    const absl::StatusOr<uint64_t> number = queue.submit(7, [&order, &done, i](uint64_t given) {
      order.push_back(given);
      if (i == kJobs) done.set_value();
    });
    ASSERT_TRUE(number.ok()) << number.status();
    EXPECT_EQ(*number, i);
  }
  done.get_future().wait();
  ASSERT_EQ(order.size(), kJobs);
  for (uint64_t i = 0; i < kJobs; ++i) EXPECT_EQ(order[i], i + 1);
}

TEST(ChangeQueueTest, ASlowKeyDoesNotDelayAnotherKey) {
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  std::promise<void> other_ran;
  ChangeQueue queue(2, 4);
  ASSERT_TRUE(queue.submit(1, [released](uint64_t) { released.wait(); }).ok());
  ASSERT_TRUE(queue.submit(2, [&other_ran](uint64_t) { other_ran.set_value(); }).ok());
  other_ran.get_future().wait();
  EXPECT_EQ(queue.pending(1), 1u);
  release.set_value();
}

TEST(ChangeQueueTest, AFullQueueRefusesAndNamesTheLimit) {
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  ChangeQueue queue(1, 2);
  ASSERT_TRUE(queue.submit(1, [released](uint64_t) { released.wait(); }).ok());
  ASSERT_TRUE(queue.submit(1, [](uint64_t) {}).ok());
  const absl::StatusOr<uint64_t> number = queue.submit(1, [](uint64_t) {});
  EXPECT_EQ(number.status().code(), absl::StatusCode::kResourceExhausted);
  const std::optional<Refusal> refusal = refusal_of(number.status());
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->limit, "pending_changes");
  EXPECT_EQ(refusal->limit_value, 2);
  EXPECT_EQ(refusal->asked, 3);
  EXPECT_GT(refusal->retry_after_ms, 0u);
  release.set_value();
}

TEST(ChangeQueueTest, AForgottenKeyFinishesItsJobsAndCountsFromOneAgain) {
  std::promise<void> started;
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  std::promise<void> second_ran;
  ChangeQueue queue(1, 4);
  const auto first = [&started, released](uint64_t) {
    started.set_value();
    released.wait();
  };
  ASSERT_TRUE(queue.submit(1, first).ok());
  started.get_future().wait();
  ASSERT_TRUE(queue.submit(1, [&second_ran](uint64_t) { second_ran.set_value(); }).ok());
  queue.forget(1);
  release.set_value();
  second_ran.get_future().wait();
  std::promise<void> other_ran;
  ASSERT_TRUE(queue.submit(2, [&other_ran](uint64_t) { other_ran.set_value(); }).ok());
  other_ran.get_future().wait();
  EXPECT_EQ(*queue.submit(1, [](uint64_t) {}), 1u);
}

TEST(ChangeQueueTest, TheDestructorWaitsForTheRunningJob) {
  std::atomic<int> ended{0};
  std::promise<void> started;
  {
    ChangeQueue queue(1, 4);
    const auto job = [&started, &ended](uint64_t) {
      started.set_value();
      ++ended;
    };
    ASSERT_TRUE(queue.submit(1, job).ok());
    started.get_future().wait();
  }
  EXPECT_EQ(ended.load(), 1);
}

}  // namespace
}  // namespace locus::server
