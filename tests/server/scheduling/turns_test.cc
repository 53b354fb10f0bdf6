#include "server/scheduling/turns.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace locus::server {
namespace {

TEST(TurnsTest, NoMoreThanTheMaximumAreTakenAtOnceAndEverybodyGetsOne) {
  constexpr int kMax = 2;
  Turns turns(kMax);
  std::atomic<int> taken{0}, done{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&] {
      for (int round = 0; round < 100; ++round) {
        const Turns::Turn turn(turns);
        EXPECT_LE(taken.fetch_add(1) + 1, kMax);
        std::this_thread::yield();
        taken.fetch_sub(1);
        ++done;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(done.load(), 800);
}

}  // namespace
}  // namespace locus::server
