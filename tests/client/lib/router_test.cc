// Tests of a client with several addresses, against servers that play the members of a cluster.
#include "client/lib/router.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "client/lib/client.h"
#include "client/lib/status.h"
#include "tests/client/lib/fake_member.h"

namespace locus::client {
namespace {

using ::testing::ElementsAre;
using testing::FakeCluster;
using testing::FakeMember;
using ::testing::HasSubstr;

v1::UpdateBatch batch_of(uint64_t tick, uint64_t number = 0) {
  v1::UpdateBatch batch;
  batch.set_tick(tick);
  if (number != 0) {
    batch.set_writer(9);
    batch.set_batch(number);
  }
  return batch;
}

v1::Reason refusal_of(const absl::Status& status) {
  const std::optional<v1::Error> error = error_of(status);
  return error ? error->reason() : v1::REASON_UNSPECIFIED;
}

class RouterTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 3; ++i) members_.push_back(std::make_unique<FakeMember>(cluster_));
    lead(0);
  }
  void lead(size_t index) {
    const std::lock_guard lock(cluster_.mutex);
    cluster_.leader = members_[index]->address();
    ++cluster_.token;
  }
  void lead_nobody() {
    const std::lock_guard lock(cluster_.mutex);
    cluster_.leader.clear();
  }
  std::vector<uint64_t> applied() {
    const std::lock_guard lock(cluster_.mutex);
    return cluster_.applied;
  }
  std::unique_ptr<Client> connect(std::vector<size_t> indices, ReadFrom read_from = ReadFrom::kLeader,
                                  int attempts = 60) {
    std::vector<std::string> addresses;
    for (const size_t index : indices) addresses.push_back(members_[index]->address());
    ClientOptions options;
    options.cluster.read_from = read_from;
    options.cluster.retry = {attempts, absl::Milliseconds(20), absl::Milliseconds(50)};
    absl::StatusOr<std::unique_ptr<Client>> client = Client::connect_cluster(addresses, options);
    EXPECT_TRUE(client.ok()) << client.status();
    return *std::move(client);
  }

  FakeCluster cluster_;
  std::vector<std::unique_ptr<FakeMember>> members_;
};

TEST_F(RouterTest, AClientOfOneAddressFollowsNobodyAndAddsNothingToViews) {
  const auto other = Client::connect(members_[1]->address());
  const absl::Status refused = (*other)->query("arena", {}).status();
  EXPECT_EQ(refusal_of(refused), v1::REASON_ELSEWHERE);
  const auto right = Client::connect(members_[0]->address());
  EXPECT_TRUE((*right)->apply("arena", batch_of(1)).ok());
  EXPECT_TRUE((*right)->query("arena", {}).ok());
  EXPECT_EQ(members_[0]->views().front().ByteSizeLong() + members_[1]->views().front().ByteSizeLong(), 0u);
}

TEST_F(RouterTest, EveryCallReachesTheLeaderWhichMayBeAnUnknownServer) {
  const auto client = connect({1});
  EXPECT_EQ(client->apply("arena", batch_of(3))->revision(), 1u);  // also without a number
  EXPECT_EQ(client->query("arena", {})->revision(), 1u);
  EXPECT_EQ(client->get_scene("arena")->placement().leader(), members_[0]->address());
  lead(2);
  EXPECT_EQ(client->apply("arena", batch_of(4))->revision(), 2u);
  EXPECT_THAT(applied(), ElementsAre(3, 4));
}

TEST_F(RouterTest, AddressesMayBeATextWithCommas) {
  const auto client = Client::connect(members_[1]->address() + "," + members_[0]->address());
  ASSERT_TRUE(client.ok()) << client.status();
  EXPECT_EQ((*client)->address(), members_[1]->address() + "," + members_[0]->address());
  EXPECT_TRUE((*client)->apply("arena", batch_of(1)).ok());
  EXPECT_EQ(Client::connect_cluster({}).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(RouterTest, CallsWaitUntilAServerLeadsAndSayWhatToDoIfNoneDoes) {
  lead_nobody();
  const absl::Status lost = connect({0, 1, 2}, ReadFrom::kLeader, 3)->apply("arena", batch_of(1)).status();
  EXPECT_EQ(refusal_of(lost), v1::REASON_NO_LEADER);
  EXPECT_THAT(std::string(lost.message()), HasSubstr("check that these servers run"));
  const auto client = connect({0, 1, 2});
  auto ack = std::async(std::launch::async, [&] { return client->apply("arena", batch_of(1)); });
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  lead(1);
  EXPECT_TRUE(ack.get().ok());
  EXPECT_THAT(applied(), ElementsAre(1));
}

TEST_F(RouterTest, ANumberedUpdateIsSentAgainAndAppliedOnceAnotherIsNot) {
  int breaks = 2;
  cluster_.breaks = [&](const v1::UpdateBatch&) { return --breaks >= 0; };
  const auto client = connect({0, 1, 2});
  const absl::Status lost = client->apply("arena", batch_of(1)).status();
  EXPECT_TRUE(absl::IsUnavailable(lost)) << lost;
  EXPECT_FALSE(refused_by_server(lost));
  EXPECT_TRUE(client->apply("arena", batch_of(2, 1))->duplicate());
  EXPECT_THAT(applied(), ElementsAre(1, 2));
}

TEST_F(RouterTest, CallsLeaveADeadServer) {
  const auto client = connect({0, 1, 2});
  ASSERT_TRUE(client->apply("arena", batch_of(1, 1)).ok());
  members_[0]->stop();
  lead(1);
  EXPECT_TRUE(client->apply("arena", batch_of(2, 2)).ok());
  EXPECT_EQ(connect({0, 1})->query("arena", {})->revision(), 2u);
  for (const auto& member : members_) member->stop();
  const auto none = Client::connect_cluster({members_[0]->address(), members_[1]->address()});
  EXPECT_THAT(std::string(none.status().message()), HasSubstr("nothing answers at " + members_[0]->address() + ","));
}

TEST_F(RouterTest, ReadsOfTheLeaderAreMarkedSo) {
  cluster_.followers = {members_[1]->address()};
  const auto client = connect({0, 1, 2});
  EXPECT_TRUE(client->query("arena", {}).ok());
  EXPECT_TRUE(client->query_stream("arena")->send({}).get().ok());
  ASSERT_EQ(members_[0]->views().size(), 2u);
  for (const v1::View& view : members_[0]->views()) EXPECT_TRUE(view.leader_only());
  EXPECT_TRUE(members_[1]->views().empty());
}

TEST_F(RouterTest, ReadsNeverGoBackWhenAFollowerLags) {
  cluster_.followers = {members_[1]->address()};
  const auto client = connect({0, 1, 2}, ReadFrom::kFollower);
  const auto stream = client->query_stream("arena");
  ASSERT_TRUE(client->apply("arena", batch_of(1)).ok());
  ASSERT_TRUE(client->apply("arena", batch_of(2)).ok());
  EXPECT_EQ(client->query("arena", {})->revision(), 2u);
  EXPECT_EQ(stream->send({}).get()->revision(), 2u);
  EXPECT_EQ(members_[1]->views().back().at_least(), 2u);
  EXPECT_TRUE(members_[0]->views().empty());
  members_[1]->behind = 1;
  EXPECT_EQ(client->query("arena", {})->revision(), 2u);  // from the leader
  EXPECT_EQ(stream->send({}).get()->revision(), 2u);
  EXPECT_TRUE(members_[0]->views().back().leader_only());
  v1::QueryBatch earlier;
  earlier.mutable_view()->set_exactly(1);
  EXPECT_EQ(client->query("arena", earlier)->revision(), 1u);  // the view says otherwise
}

TEST_F(RouterTest, ASceneWithAnotherEpochIsBelievedOfTheLeaderOnly) {
  cluster_.followers = {members_[1]->address()};
  const auto client = connect({0, 1, 2}, ReadFrom::kFollower);
  const auto stream = client->query_stream("arena");
  ASSERT_TRUE(client->apply("arena", batch_of(1)).ok());
  cluster_.epoch = 2;
  cluster_.applied.clear();
  EXPECT_EQ(stream->send({}).get()->epoch(), 2u);
  EXPECT_EQ(client->query("arena", {})->epoch(), 2u);
  EXPECT_TRUE(members_[0]->views().front().leader_only());
}

TEST_F(RouterTest, FollowersAnswerWhileNoServerLeads) {
  cluster_.followers = {members_[1]->address()};
  const auto client = connect({0, 1, 2}, ReadFrom::kFollower);
  ASSERT_TRUE(client->query("arena", {}).ok());
  lead_nobody();
  EXPECT_TRUE(client->query("arena", {}).ok());
}

TEST_F(RouterTest, AStreamFollowsTheLeaderAndAppliesEachBatchOnceInOrder) {
  std::vector<uint64_t> broken;
  cluster_.breaks = [&](const v1::UpdateBatch& batch) {  // called with the lock held
    if (batch.tick() % 20 != 3 || std::count(broken.begin(), broken.end(), batch.tick()) > 0) return false;
    broken.push_back(batch.tick());
    cluster_.leader = members_[broken.size() % 3]->address();
    ++cluster_.token;
    return true;
  };
  const auto stream = connect({0, 1, 2})->update_stream("arena");
  std::vector<std::future<absl::StatusOr<v1::UpdateAck>>> acks;
  for (uint64_t tick = 1; tick <= 60; ++tick) {
    if (tick % 10 == 0) lead(tick / 10 % 3);
    acks.push_back(stream->send(batch_of(tick)));
  }
  EXPECT_TRUE(stream->close().ok());
  std::vector<uint64_t> all(60);
  std::iota(all.begin(), all.end(), 1);
  EXPECT_EQ(applied(), all);
  for (auto& ack : acks) EXPECT_TRUE(ack.get().ok());
  EXPECT_FALSE(broken.empty());
}

TEST_F(RouterTest, AStreamWaitsUntilAServerLeads) {
  const auto stream = connect({0, 1, 2})->update_stream("arena");
  ASSERT_TRUE(stream->send(batch_of(1)).get().ok());
  lead_nobody();
  auto second = stream->send(batch_of(2));
  auto third = stream->send(batch_of(3));
  EXPECT_EQ(second.wait_for(std::chrono::milliseconds(300)), std::future_status::timeout);
  lead(2);
  EXPECT_FALSE(second.get()->duplicate());
  EXPECT_FALSE(third.get()->duplicate());
  EXPECT_THAT(applied(), ElementsAre(1, 2, 3));
}

TEST_F(RouterTest, AStreamThatGivesUpSaysWhatToDoAndWhatIsUnknown) {
  cluster_.breaks = [&](const v1::UpdateBatch&) {
    cluster_.leader.clear();
    return true;
  };
  const auto client = connect({0, 1, 2}, ReadFrom::kLeader, 3);
  UpdateStreamOptions options;
  options.reconnect.max_attempts = 3;
  options.reconnect.first_backoff = absl::Milliseconds(10);
  const auto stream = client->update_stream("arena", options);
  const absl::Status lost = stream->send(batch_of(1)).get().status();
  EXPECT_FALSE(refused_by_server(lost)) << lost;
  EXPECT_THAT(std::string(lost.message()), HasSubstr("may have been applied"));
  EXPECT_THAT(std::string(lost.message()), HasSubstr("check that these servers run"));
}

TEST_F(RouterTest, AQueryStreamFollowsTheLeader) {
  const auto stream = connect({0, 1, 2})->query_stream("arena");
  for (const size_t index : {0, 1, 2, 1}) {
    lead(index);
    EXPECT_TRUE(stream->send({}).get().ok());
  }
}

TEST_F(RouterTest, CancelledCallsOfTheUserAreNotRepeated) {
  lead_nobody();
  const auto client = connect({0, 1, 2}, ReadFrom::kLeader, 1000);
  auto ack = std::async(std::launch::async, [&] { return client->apply("arena", batch_of(1, 1)); });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  client->cancel_calls();
  EXPECT_FALSE(ack.get().ok());
}

}  // namespace
}  // namespace locus::client
