#include "server/connections/connection.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

#include "server/connections/listening_socket.h"
#include "tests/support/machine_features.h"
#include "tests/support/raw_socket.h"
#include "tests/support/temporary_folder.h"

namespace locus::server {
namespace {

using std::chrono::steady_clock;

// Fixture that accepts connections without an Acceptor and its limits.
class ConnectionTest : public ::testing::Test {
 protected:
  // Accepts one connection of `listening`, and returns its descriptor.
  static int accept_one(const ListeningSocket& listening) {
    int descriptor = -1;
    EXPECT_TRUE(test::wait_until([&] {
      descriptor = accept4(listening.descriptor(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      return descriptor >= 0;
    }));
    return descriptor;
  }
};

TEST_F(ConnectionTest, AnIpv4PeerIsNamedAsGrpcNamesIt) {
  const auto sockets = listen_on(*parse_listen_address("127.0.0.1:0"), {});
  const test::RawSocket client(sockets->front().port(), "127.0.0.9");
  const int descriptor = accept_one(sockets->front());
  const std::optional<Peer> peer = peer_of(descriptor);
  ASSERT_TRUE(peer.has_value());
  EXPECT_EQ(peer->name.rfind("ipv4:127.0.0.9:", 0), 0u) << peer->name;
  EXPECT_EQ(peer->label, peer->name);
  EXPECT_EQ(peer->address, "127.0.0.9");
  EXPECT_EQ(peer->limit_key, "127.0.0.9");
  EXPECT_FALSE(peer->uid.has_value());
  close(descriptor);
}

TEST_F(ConnectionTest, AnIpv4PeerOfADualSocketIsAnIpv4Peer) {
  if (!test::has_ipv6()) GTEST_SKIP() << "this machine has no IPv6";
  const auto sockets = listen_on(*parse_listen_address("[::]:0"), {});
  ASSERT_TRUE(sockets.ok()) << sockets.status();
  const test::RawSocket client(sockets->front().port());
  const int descriptor = accept_one(sockets->front());
  EXPECT_EQ(peer_of(descriptor)->address, "127.0.0.1");
  EXPECT_EQ(peer_of(descriptor)->name.rfind("ipv4:127.0.0.1:", 0), 0u);
  close(descriptor);
}

TEST_F(ConnectionTest, AUnixPeerIsNamedByItsDescriptorAndItsUser) {
  const test::TemporaryFolder folder;
  const auto sockets = listen_on(*parse_listen_address("unix:" + folder.file("socket")), {});
  const test::RawSocket client(folder.file("socket"));
  const int descriptor = accept_one(sockets->front());
  const std::optional<Peer> peer = peer_of(descriptor);
  ASSERT_TRUE(peer.has_value());
  EXPECT_EQ(peer->name, "fd:" + std::to_string(descriptor));
  EXPECT_EQ(peer->label, "unix:uid=" + std::to_string(getuid()) + ",pid=" + std::to_string(getpid()));
  EXPECT_EQ(peer->uid, getuid());
  EXPECT_EQ(peer->limit_key, "uid:" + std::to_string(getuid()));
  close(descriptor);
}

TEST_F(ConnectionTest, CloseEndsTheConnectionOnceAndKeepsTheFirstReason) {
  std::array<int, 2> ends{};
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()), 0);
  Connection connection({}, steady_clock::now(), ends[0]);
  EXPECT_EQ(connection.close_reason(), nullptr);
  EXPECT_TRUE(connection.close("first"));
  EXPECT_FALSE(connection.close("second"));
  EXPECT_STREQ(connection.close_reason(), "first");
  char byte = 0;
  EXPECT_EQ(read(ends[1], &byte, 1), 0);
  close(ends[1]);
}

TEST_F(ConnectionTest, AReleasedConnectionHasNoDescriptorAndCannotBeClosed) {
  std::array<int, 2> ends{};
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()), 0);
  Connection connection({}, steady_clock::now(), ends[0]);
  connection.release();
  EXPECT_EQ(connection.descriptor(), -1);
  EXPECT_FALSE(connection.close("late"));
  EXPECT_EQ(connection.received().bytes, 0u);
  char byte = 0;
  EXPECT_EQ(read(ends[1], &byte, 1), 0);
  close(ends[1]);
}

TEST_F(ConnectionTest, CloseDiscardsTheBytesThatHaveArrived) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  const int transport = dup(ends[0]);
  Connection connection({}, steady_clock::now(), ends[0]);
  const std::string bytes(100'000, 'x');
  ASSERT_EQ(write(ends[1], bytes.data(), bytes.size()), 100'000);
  EXPECT_TRUE(connection.close("flood"));
  char byte = 0;
  EXPECT_EQ(read(transport, &byte, 1), 0);
  close(transport);
  close(ends[1]);
}

TEST_F(ConnectionTest, CountsAreSumsAndOpenCallsAreThoseThatHaveNotEnded) {
  Connection connection({}, steady_clock::now(), -1);
  connection.call_begun(100);
  connection.call_begun(20);
  connection.call_cancelled();
  connection.call_ended();
  connection.message_read(10);
  connection.message_read(5);
  connection.written(7);
  const CallCounts counts = connection.counts();
  EXPECT_EQ(counts.calls_begun, 2u);
  EXPECT_EQ(counts.calls_open, 1u);
  EXPECT_EQ(counts.calls_cancelled, 1u);
  EXPECT_EQ(counts.metadata_bytes, 120u);
  EXPECT_EQ(counts.messages_read, 2u);
  EXPECT_EQ(counts.message_bytes, 15u);
  EXPECT_EQ(counts.bytes_written, 7u);
}

TEST_F(ConnectionTest, TheKernelCountsReceivedBytes) {
  const auto sockets = listen_on(*parse_listen_address("127.0.0.1:0"), {});
  test::RawSocket client(sockets->front().port());
  const Connection connection({}, steady_clock::now(), accept_one(sockets->front()));
  EXPECT_TRUE(client.send(std::string(1000, 'x')));
  EXPECT_TRUE(test::wait_until([&] { return connection.received().bytes == 1000; }));
  EXPECT_GE(connection.received().segments, 1u);
}

TEST_F(ConnectionTest, TheStoredIdentityIsReturned) {
  Connection connection({}, steady_clock::now(), -1);
  EXPECT_EQ(connection.identity(), nullptr);
  const auto identity = std::make_shared<const int>(7);
  connection.set_identity(identity);
  EXPECT_EQ(connection.identity(), identity);
}

}  // namespace
}  // namespace locus::server
