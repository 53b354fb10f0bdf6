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
    const absl::StatusOr<uint64_t> number = queue.submit(7, [&order, &done, i] {
      order.push_back(i);
      if (i == kJobs) done.set_value();
    });
    ASSERT_TRUE(number.ok()) << number.status();
    EXPECT_EQ(*number, i);
  }
  done.get_future().wait();
  ASSERT_EQ(order.size(), kJobs);
  for (uint64_t i = 0; i < kJobs; ++i) EXPECT_EQ(order[i], i + 1);
}

TEST(ChangeQueueTest, ASlowKeyDoesNotHoldUpAnother) {
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  std::promise<void> other_ran;
  ChangeQueue queue(2, 4);
  ASSERT_TRUE(queue.submit(1, [released] { released.wait(); }).ok());
  ASSERT_TRUE(queue.submit(2, [&other_ran] { other_ran.set_value(); }).ok());
  other_ran.get_future().wait();
  EXPECT_EQ(queue.pending(1), 1u);
  release.set_value();
}

TEST(ChangeQueueTest, AFullLineRefusesNamingTheLimit) {
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  ChangeQueue queue(1, 2);
  ASSERT_TRUE(queue.submit(1, [released] { released.wait(); }).ok());
  ASSERT_TRUE(queue.submit(1, [] {}).ok());
  const absl::StatusOr<uint64_t> number = queue.submit(1, [] {});
  EXPECT_EQ(number.status().code(), absl::StatusCode::kResourceExhausted);
  const std::optional<Refusal> refusal = refusal_of(number.status());
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->limit, "pending_changes");
  EXPECT_EQ(refusal->limit_value, 2);
  EXPECT_EQ(refusal->asked, 3);
  EXPECT_GT(refusal->retry_after_ms, 0u);
  release.set_value();
}

TEST(ChangeQueueTest, AForgottenKeyDropsItsWaitingJobsAndStartsOver) {
  std::promise<void> started;
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  std::atomic<bool> dropped_ran{false};
  ChangeQueue queue(1, 4);
  ASSERT_TRUE(queue
                  .submit(1,
                          [&started, released] {
                            started.set_value();
                            released.wait();
                          })
                  .ok());
  started.get_future().wait();
  ASSERT_TRUE(queue.submit(1, [&dropped_ran] { dropped_ran = true; }).ok());
  queue.forget(1);
  std::promise<void> other_ran;
  ASSERT_TRUE(queue.submit(2, [&other_ran] { other_ran.set_value(); }).ok());
  release.set_value();
  other_ran.get_future().wait();
  EXPECT_FALSE(dropped_ran.load());
  EXPECT_EQ(queue.pending(1), 0u);
  EXPECT_EQ(*queue.submit(1, [] {}), 1u);
}

TEST(ChangeQueueTest, TheDestructorDropsWhatHasNotBegun) {
  std::atomic<bool> second_ran{false};
  std::promise<void> started;
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  std::thread releaser;
  {
    ChangeQueue queue(1, 4);
    ASSERT_TRUE(queue
                    .submit(1,
                            [&started, released] {
                              started.set_value();
                              released.wait();
                            })
                    .ok());
    started.get_future().wait();
    ASSERT_TRUE(queue.submit(1, [&second_ran] { second_ran = true; }).ok());
    queue.forget(1);
    releaser = std::thread([&release] { release.set_value(); });
  }
  releaser.join();
  EXPECT_FALSE(second_ran.load());
}

}  // namespace
}  // namespace locus::server
