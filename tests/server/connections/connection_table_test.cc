#include "server/connections/connection_table.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <string>
#include <thread>
#include <vector>

#include "server/connections/listening_socket.h"
#include "tests/support/raw_socket.h"

namespace locus::server {
namespace {

std::shared_ptr<Connection> named(const std::string& name) {
  Peer peer;
  peer.name = name;
  return std::make_shared<Connection>(peer, std::chrono::steady_clock::time_point(), -1);
}

TEST(ConnectionTableTest, AnAddedConnectionIsFoundUntilItIsRemoved) {
  ConnectionTable table;
  const auto first = named("ipv4:127.0.0.1:1");
  const auto second = named("ipv4:127.0.0.1:2");
  table.add(first);
  table.add(second);
  EXPECT_EQ(table.find("ipv4:127.0.0.1:1"), first);
  EXPECT_EQ(table.find("ipv4:127.0.0.1:2"), second);
  EXPECT_EQ(table.size(), 2u);
  table.remove(*first);
  EXPECT_NE(table.find("ipv4:127.0.0.1:1"), first);
  EXPECT_EQ(table.size(), 1u);
}

TEST(ConnectionTableTest, RemovingAReplacedConnectionKeepsItsSuccessor) {
  ConnectionTable table;
  const auto old = named("fd:7");
  const auto successor = named("fd:7");
  table.add(old);
  table.add(successor);
  table.remove(*old);
  EXPECT_EQ(table.find("fd:7"), successor);
}

TEST(ConnectionTableTest, CallsOfAnUnknownPeerShareAStandInThatCannotBeClosed) {
  ConnectionTable table;
  const auto stand_in = table.find("ipv4:10.0.0.1:5");
  stand_in->call_begun(0);
  EXPECT_EQ(table.find("ipv4:10.0.0.1:5"), stand_in);
  EXPECT_NE(table.find("ipv4:10.0.0.1:6"), stand_in);
  EXPECT_EQ(stand_in->peer().name, "ipv4:10.0.0.1:5");
  EXPECT_EQ(stand_in->peer().uid, std::nullopt);
  EXPECT_FALSE(stand_in->close("test"));
  EXPECT_EQ(table.size(), 0u);
}

TEST(ConnectionTableTest, AnAcceptedConnectionReplacesAStandIn) {
  ConnectionTable table;
  const auto stand_in = table.find("fd:7");
  const auto accepted = named("fd:7");
  table.add(accepted);
  EXPECT_EQ(table.find("fd:7"), accepted);
}

TEST(ConnectionTableTest, ThreadsFindTheirConnectionsWhileOthersComeAndGo) {
  ConnectionTable table;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&table, t] {
      for (int i = 0; i < 2000; ++i) {
        const auto own = named("ipv4:127.0.0." + std::to_string(t) + ":" + std::to_string(i % 50));
        table.add(own);
        EXPECT_EQ(table.find(own->peer().name), own);
        table.find("fd:" + std::to_string(i))->call_begun(0);
        table.remove(*own);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(table.size(), 0u);
}

// Fixture with a table of three accepted connections.
class ShedTest : public testing::Test {
 protected:
  static constexpr uint64_t kMinBytes = 10'000;

  void SetUp() override {
    const auto sockets = listen_on(*parse_listen_address("127.0.0.1:0"), {});
    for (int i = 0; i < 3; ++i) {
      clients_.push_back(std::make_unique<test::RawSocket>(sockets->front().port()));
      int descriptor = -1;
      ASSERT_TRUE(test::wait_until([&] {
        descriptor = accept4(sockets->front().descriptor(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
        return descriptor >= 0;
      }));
      connections_.push_back(
          std::make_shared<Connection>(*peer_of(descriptor), std::chrono::steady_clock::now(), descriptor));
      table_.add(connections_.back());
    }
  }
  // Sends to a connection, and waits until the connection has received `sum` bytes in all.
  void send(size_t i, size_t bytes, uint64_t sum) {
    ASSERT_TRUE(clients_[i]->send(std::string(bytes, 'x')));
    ASSERT_TRUE(test::wait_until([&] { return connections_[i]->received().bytes == sum; }));
  }

  ConnectionTable table_;
  std::vector<std::unique_ptr<test::RawSocket>> clients_;
  std::vector<std::shared_ptr<Connection>> connections_;
};

TEST_F(ShedTest, TheConnectionThatSendsMostIsClosedAndOthersAreNot) {
  send(0, 5'000, 5'000);
  EXPECT_EQ(table_.shed_heaviest(false, kMinBytes, "short"), 0u);  // records 5,000 bytes, so only later bytes count
  send(0, 6'000, 11'000);
  send(1, 9'000, 9'000);
  send(2, 1, 1);
  EXPECT_EQ(table_.shed_heaviest(true, kMinBytes, "short"), 0u);  // no client sent enough since the previous call
  send(1, 15'000, 24'000);
  EXPECT_EQ(table_.shed_heaviest(true, kMinBytes, "short"), 1u);
  EXPECT_STREQ(connections_[1]->close_reason(), "short");
  EXPECT_EQ(connections_[0]->close_reason(), nullptr);
  EXPECT_EQ(connections_[2]->close_reason(), nullptr);
}

TEST_F(ShedTest, AConnectionThatHoldsClaimsIsClosedBeforeOneWhoseMessagesExplainItsBytes) {
  connections_[0]->message_read(40'000);
  send(0, 40'000, 40'000);
  connections_[1]->claimed_bytes = 30'000;
  connections_[2]->claimed_bytes = 9'000;
  EXPECT_EQ(table_.shed_heaviest(true, kMinBytes, "short"), 1u);
  EXPECT_EQ(connections_[0]->close_reason(), nullptr);
  EXPECT_STREQ(connections_[1]->close_reason(), "short");
  EXPECT_EQ(connections_[2]->close_reason(), nullptr);
}

}  // namespace
}  // namespace locus::server
