#include "server/scheduling/fair_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <vector>

namespace locus::server {
namespace {

using testing::ElementsAre;

constexpr uint64_t kTurn = 10;

// Returns the clients of the next `count` turns. An entry of the queue is 1000 times the client's number, plus an
// index. Entries stay queued.
std::vector<uint64_t> clients_in_turn(FairQueue<int>& queue, int count) {
  std::vector<uint64_t> clients;
  for (int i = 0; i < count; ++i) clients.push_back(static_cast<uint64_t>(queue.next(kTurn) / 1000));
  return clients;
}

TEST(FairQueueTest, ClientsTakeTurnsHoweverManyEntriesTheyHave) {
  FairQueue<int> queue;
  for (int i = 0; i < 50; ++i) queue.push_back(1, 1000 + i);
  queue.push_back(2, 2000);
  EXPECT_THAT(clients_in_turn(queue, 6), ElementsAre(1, 2, 1, 2, 1, 2));
}

TEST(FairQueueTest, EntriesOfAClientKeepTheirOrder) {
  FairQueue<int> queue;
  queue.push_back(1, 1001);
  queue.push_back(1, 1002);
  queue.push_front(1, 1000);
  EXPECT_EQ(queue.next(kTurn), 1000);
  EXPECT_TRUE(queue.remove(1, 1000));
  EXPECT_EQ(queue.next(kTurn), 1001);
}

TEST(FairQueueTest, AClientThatUsedMoreThanChargedWaitsLonger) {
  FairQueue<int> queue;
  queue.push_back(1, 1000);
  queue.push_back(2, 2000);
  EXPECT_EQ(queue.next(kTurn), 1000);
  queue.charge(1, 2 * kTurn);
  EXPECT_THAT(clients_in_turn(queue, 5), ElementsAre(2, 2, 2, 1, 2));
}

TEST(FairQueueTest, AClientThatUsedLessThanChargedIsServedSooner) {
  FairQueue<int> queue;
  queue.push_back(1, 1000);
  queue.push_back(2, 2000);
  EXPECT_EQ(queue.next(kTurn), 1000);
  queue.charge(1, -static_cast<int64_t>(kTurn));
  EXPECT_EQ(queue.next(kTurn), 1000);
}

TEST(FairQueueTest, AnAbsentClientSavesUpNoShare) {
  FairQueue<int> queue;
  queue.push_back(1, 1000);
  clients_in_turn(queue, 1000);
  queue.push_back(2, 2000);
  const std::vector<uint64_t> turns = clients_in_turn(queue, 10);
  EXPECT_LE(std::count(turns.begin(), turns.end(), 2), 6);
}

TEST(FairQueueTest, AClientThatLeavesOverdrawnReturnsOverdrawn) {
  FairQueue<int> queue;
  queue.push_back(1, 1000);
  queue.push_back(2, 2000);
  EXPECT_EQ(queue.next(kTurn), 1000);
  queue.charge(1, 4 * kTurn);
  queue.remove(1, 1000);
  queue.push_back(1, 1000);
  EXPECT_THAT(clients_in_turn(queue, 5), ElementsAre(2, 2, 2, 2, 2));
  EXPECT_EQ(queue.next(kTurn), 1000);
}

TEST(FairQueueTest, RemovedEntriesAreNotServed) {
  FairQueue<int> queue;
  for (int i = 0; i < 10; ++i) queue.push_back(static_cast<uint64_t>(i % 3), i);
  EXPECT_THAT(queue.remove_if([](int entry) { return entry % 2 == 0; }), testing::UnorderedElementsAre(0, 2, 4, 6, 8));
  EXPECT_FALSE(queue.remove(0, 0));
  EXPECT_FALSE(queue.remove(77, 0)) << "no such client";
  for (int i = 1; i < 10; i += 2) EXPECT_TRUE(queue.remove(static_cast<uint64_t>(i % 3), i));
  EXPECT_TRUE(queue.empty());
}

TEST(FairQueueTest, IdleClientsAreForgotten) {
  FairQueue<int> queue;
  for (uint64_t client = 0; client < 3 * FairQueue<int>::kMaxIdleClients; ++client) {
    queue.push_back(client, 1);
    queue.next(kTurn);
    queue.charge(client, 1'000'000);
    queue.remove(client, 1);
  }
  EXPECT_TRUE(queue.empty());
  EXPECT_LE(queue.clients(), FairQueue<int>::kMaxIdleClients);
}

// The costs of turns are random. Clients whose entries always wait get equal work: the difference is at most the sum of
// the maximum cost of a turn (kMax) and its estimated cost (kTurn).
TEST(FairQueueTest, SharesAreEqualByWorkNotByTurns) {
  FairQueue<int> queue;
  std::mt19937 random(1);
  for (int client = 1; client <= 5; ++client) queue.push_back(static_cast<uint64_t>(client), client * 1000);
  std::map<int, double> had;
  constexpr uint64_t kMax = 100;
  for (int i = 0; i < 10'000; ++i) {
    const int client = queue.next(kTurn) / 1000;
    // The turns of client 5 are longer than those of other clients.
    const uint64_t cost = random() % (client == 5 ? kMax : 5);
    queue.charge(static_cast<uint64_t>(client), static_cast<int64_t>(cost) - static_cast<int64_t>(kTurn));
    had[client] += static_cast<double>(cost);
  }
  for (const auto& [client, cost] : had) EXPECT_NEAR(cost, had[1], double{kMax + kTurn}) << client;
}

}  // namespace
}  // namespace locus::server
