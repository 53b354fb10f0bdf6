#include "server/scheduling/worker_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <thread>
#include <vector>

namespace locus::server {
namespace {

TEST(WorkerPoolTest, EveryIndexIsVisitedOnceForAnyNumberOfThreads) {
  for (const uint32_t threads : {1u, 2u, 4u}) {
    WorkerPool pool(threads);
    for (const size_t n : {size_t{0}, size_t{1}, size_t{2}, size_t{1000}}) {
      std::vector<int> calls(n, 0);
      pool.parallel_for(n, [&](size_t i) { ++calls[i]; });
      EXPECT_EQ(calls, std::vector<int>(n, 1)) << threads << " threads";
    }
  }
}

TEST(WorkerPoolTest, ResultsWrittenByHelpersAreVisibleToTheCaller) {
  WorkerPool pool(4);
  for (int round = 0; round < 200; ++round) {
    std::vector<size_t> squares(64, 0);
    pool.parallel_for(squares.size(), [&](size_t i) { squares[i] = i * i; });
    for (size_t i = 0; i < squares.size(); ++i) ASSERT_EQ(squares[i], i * i);
  }
}

TEST(WorkerPoolTest, ManyCallersShareThePool) {
  WorkerPool pool(3);
  std::atomic<size_t> total{0};
  std::vector<std::thread> callers;
  for (int caller = 0; caller < 8; ++caller)
    callers.emplace_back([&] {
      for (int round = 0; round < 50; ++round) pool.parallel_for(17, [&](size_t) { total.fetch_add(1); });
    });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(total.load(), size_t{8} * 50 * 17);
}

TEST(WorkerPoolTest, ANestedListEndsThoughAllHelpersAreBusy) {
  WorkerPool pool(2);
  std::atomic<size_t> total{0};
  pool.parallel_for(8, [&](size_t) { pool.parallel_for(8, [&](size_t) { total.fetch_add(1); }); });
  EXPECT_EQ(total.load(), 64u);
}

TEST(WorkerPoolTest, OneThreadWorksInOrderOnTheCallersThread) {
  WorkerPool pool(1);
  std::vector<size_t> order;
  const std::thread::id caller = std::this_thread::get_id();
  pool.parallel_for(5, [&](size_t i) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    order.push_back(i);
  });
  EXPECT_EQ(order, (std::vector<size_t>{0, 1, 2, 3, 4}));
}

}  // namespace
}  // namespace locus::server
