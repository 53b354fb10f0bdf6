#include "server/scheduling/client_shares.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

namespace locus::server {
namespace {

TEST(ClientSharesTest, EveryConnectionOfAClientHasTheSameCounter) {
  ClientShares shares;
  const auto first = shares.of("token:ann"), second = shares.of("token:ann"), other = shares.of("token:bob");
  first->fetch_add(7);
  EXPECT_EQ(second->load(), 7u);
  EXPECT_EQ(other->load(), 0u);
}

TEST(ClientSharesTest, ACounterThatNobodyHoldsStartsAgainAtZero) {
  ClientShares shares;
  shares.of("token:ann")->fetch_add(7);
  EXPECT_EQ(shares.of("token:ann")->load(), 0u);
}

TEST(ClientSharesTest, ACounterMayOutliveTheShares) {
  std::shared_ptr<ClientShares::Counter> counter;
  {
    ClientShares shares;
    counter = shares.of("token:ann");
  }
  EXPECT_EQ(counter->fetch_add(1), 0u);
}

TEST(ClientSharesTest, EntriesOfClientsThatHaveGoneAreRemoved) {
  ClientShares shares;
  const auto kept = shares.of("kept");
  kept->fetch_add(1);
  for (int i = 0; i < 100'000; ++i) shares.of("client" + std::to_string(i));
  EXPECT_LT(shares.size(), 2'000u);
  EXPECT_EQ(shares.of("kept")->load(), 1u);
}

TEST(ClientSharesTest, ThreadsThatClaimAndReleaseAtFullSpeedLeaveZero) {
  ClientShares shares;
  const auto watched = shares.of("client0");
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 4; ++thread) {
    threads.emplace_back([&shares] {
      for (int i = 0; i < 20'000; ++i) {
        const auto counter = shares.of("client" + std::to_string(i % 3));
        counter->fetch_add(5);
        counter->fetch_sub(5);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(watched->load(), 0u);
  EXPECT_EQ(shares.of("client0"), watched);
}

}  // namespace
}  // namespace locus::server
