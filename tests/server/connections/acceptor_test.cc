#include "server/connections/acceptor.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <optional>
#include <set>

#include "tests/support/raw_socket.h"
#include "tests/support/temporary_folder.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using test::kHttp2Opening;
using test::RawSocket;
using test::wait_until;

// An acceptor whose connections are taken over by the test instead of gRPC.
class AcceptorTest : public ::testing::Test {
 protected:
  ~AcceptorTest() override {
    acceptor_.reset();
    for (const int descriptor : taken_) close(descriptor);
  }

  void start(const AcceptorOptions& options = {}, const std::string& address = "127.0.0.1:0") {
    auto sockets = listen_on(*parse_listen_address(address), {});
    ASSERT_TRUE(sockets.ok()) << sockets.status();
    port_ = sockets->front().port();
    AcceptorHooks hooks;
    hooks.hand_over = [this](int descriptor, const std::shared_ptr<Connection>& connection) {
      const MutexLock lock(mutex_);
      taken_.insert(descriptor);
      names_.insert(connection->peer().name);
    };
    hooks.refused = [this](uint64_t refused, const std::string&, const char* reason) {
      const MutexLock lock(mutex_);
      refused_ += refused;
      reasons_.insert(reason);
    };
    acceptor_.emplace(*std::move(sockets), options, table_, guard_, std::move(hooks));
  }

  RawSocket client(const std::string& from = "127.0.0.1") {
    RawSocket made(port_, from);
    EXPECT_TRUE(made.connected());
    return made;
  }
  // Opens a connection like a client of HTTP/2.
  RawSocket good_client(const std::string& from = "127.0.0.1") {
    RawSocket made = client(from);
    EXPECT_TRUE(made.send(kHttp2Opening));
    return made;
  }
  size_t taken() {
    const MutexLock lock(mutex_);
    return taken_.size();
  }
  // Closes the descriptors of all connections as gRPC does.
  void end_taken() {
    const MutexLock lock(mutex_);
    for (const int descriptor : taken_) {
      shutdown(descriptor, SHUT_RDWR);
      close(descriptor);
    }
    taken_.clear();
  }
  uint64_t refused() {
    const MutexLock lock(mutex_);
    return refused_;
  }
  bool has_reason(const std::string& reason) {
    const MutexLock lock(mutex_);
    return reasons_.contains(reason);
  }

  ConnectionTable table_;
  FloodGuard guard_{FloodLimits(), [](Connection&) { return std::nullopt; }, [](const Connection&, const char*) {}};
  Mutex mutex_;
  std::set<int> taken_;
  std::set<std::string> names_;
  std::set<std::string> reasons_;
  uint64_t refused_ = 0;
  int port_ = 0;
  std::optional<Acceptor> acceptor_;
};

TEST_F(AcceptorTest, AConnectionIsHandedOverWithItsFirstBytesStillUnread) {
  start();
  RawSocket opened = good_client();
  ASSERT_TRUE(wait_until([&] { return taken() == 1; }));
  char bytes[64];
  const ssize_t count = recv(*taken_.begin(), bytes, sizeof bytes, 0);
  EXPECT_EQ(std::string(bytes, static_cast<size_t>(count)), kHttp2Opening);
  EXPECT_EQ(table_.size(), 1u);
  EXPECT_EQ(table_.find(*names_.begin())->peer().address, "127.0.0.1");
}

TEST_F(AcceptorTest, BytesMayComeOneByOne) {
  start();
  RawSocket slow = client();
  for (const char byte : kHttp2Opening) {
    EXPECT_TRUE(slow.send(std::string(1, byte)));
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_TRUE(wait_until([&] { return taken() == 1; }));
}

TEST_F(AcceptorTest, GarbageIsResetWithoutBeingHandedOver) {
  start();
  RawSocket other = client();
  EXPECT_TRUE(other.send("GET / HTTP/1.1\r\n\r\n"));
  EXPECT_TRUE(other.wait_closed());
  RawSocket gone = client();
  EXPECT_TRUE(wait_until([&] { return refused() == 1; }));
  EXPECT_EQ(taken(), 0u);
  EXPECT_EQ(table_.counters().refused_bytes, 1u);
}

TEST_F(AcceptorTest, ATlsPortTakesOnlyClientHellos) {
  AcceptorOptions options;
  options.tcp_transport = Transport::kTls;
  start(options);
  RawSocket plain = good_client();
  EXPECT_TRUE(plain.wait_closed());
  RawSocket tls = client();
  EXPECT_TRUE(tls.send(std::string("\x16\x03\x01\x02\x00\x01", 6)));
  EXPECT_TRUE(wait_until([&] { return taken() == 1; }));
}

TEST_F(AcceptorTest, ConnectionsBeyondTheLimitOfTheirAddressAreReset) {
  AcceptorOptions options;
  options.limits.connections_per_address = 3;
  start(options);
  std::vector<RawSocket> kept;
  for (int i = 0; i < 3; ++i) kept.push_back(good_client());
  ASSERT_TRUE(wait_until([&] { return taken() == 3; }));
  RawSocket excess = client();
  EXPECT_TRUE(excess.wait_closed());
  kept.push_back(good_client("127.0.0.2"));
  EXPECT_TRUE(wait_until([&] { return taken() == 4; }));
  EXPECT_EQ(table_.counters().refused_address, 1u);
  EXPECT_TRUE(wait_until([&] { return has_reason("max-connections-per-address"); }));
}

TEST_F(AcceptorTest, ConnectionsBeyondTheLimitOnAllAreResetUntilOneEnds) {
  AcceptorOptions options;
  options.limits.connections = 2;
  start(options);
  std::vector<RawSocket> kept;
  for (const char* from : {"127.0.0.1", "127.0.0.2"}) kept.push_back(good_client(from));
  ASSERT_TRUE(wait_until([&] { return taken() == 2; }));
  RawSocket excess = client("127.0.0.3");
  EXPECT_TRUE(excess.wait_closed());
  end_taken();
  ASSERT_TRUE(wait_until([&] { return table_.counters().ended == 2; }));
  RawSocket next = good_client("127.0.0.3");
  EXPECT_TRUE(wait_until([&] { return taken() == 1; }));
  EXPECT_EQ(table_.counters().refused_full, 1u);
}

TEST_F(AcceptorTest, NewConnectionsBeyondTheRateAreReset) {
  AcceptorOptions options;
  options.limits.new_per_second = 1;
  options.limits.burst = 5;
  start(options);
  std::vector<RawSocket> clients;
  for (int i = 0; i < 50; ++i) clients.push_back(client());
  EXPECT_TRUE(wait_until([&] { return table_.counters().accepted == 50; }));
  EXPECT_GE(table_.counters().refused_too_fast, 30u);
  EXPECT_TRUE(wait_until([&] { return refused() == table_.counters().refused_too_fast; }));
  EXPECT_TRUE(has_reason("max-new-connections"));
}

TEST_F(AcceptorTest, ASilentConnectionIsClosedAfterTheTimeout) {
  AcceptorOptions options;
  options.opening_timeout = milliseconds(200);
  start(options);
  RawSocket silent = client();
  RawSocket partial = client();
  EXPECT_TRUE(partial.send(kHttp2Opening.substr(0, 20)));
  EXPECT_TRUE(silent.wait_closed());
  EXPECT_TRUE(partial.wait_closed());
  EXPECT_EQ(table_.counters().late, 2u);
}

TEST_F(AcceptorTest, OnlyConnectionsWithoutOpenCallsAreIdle) {
  AcceptorOptions options;
  options.idle_timeout = milliseconds(200);
  start(options);
  RawSocket busy = good_client();
  ASSERT_TRUE(wait_until([&] { return taken() == 1; }));
  table_.find(*names_.begin())->call_begun(0);
  RawSocket idle = good_client("127.0.0.2");
  EXPECT_TRUE(idle.wait_closed());
  EXPECT_TRUE(busy.discard());
  table_.find(*names_.begin())->call_ended();
  EXPECT_TRUE(busy.wait_closed());
}

TEST_F(AcceptorTest, TheClientSeesTheEndWhenGrpcClosesAndTheConnectionIsForgotten) {
  start();
  RawSocket opened = good_client();
  ASSERT_TRUE(wait_until([&] { return taken() == 1; }));
  end_taken();
  EXPECT_TRUE(opened.wait_closed());
  EXPECT_TRUE(wait_until([&] { return table_.size() == 0; }));
}

TEST_F(AcceptorTest, DescriptorsComeBackAfterManyConnectionsOfEachKind) {
  AcceptorOptions options;
  options.limits.new_per_second = 100'000;
  options.limits.burst = 100'000;
  start(options);
  const size_t before = test::open_descriptors();
  for (int i = 0; i < 2000; ++i) {
    RawSocket visitor = client();
    if (i % 3 < 2) visitor.send(i % 3 == 0 ? kHttp2Opening : "garbage");
    if (i % 100 == 0) end_taken();
  }
  EXPECT_TRUE(wait_until([&] {
    end_taken();
    return test::open_descriptors() == before && table_.size() == 0;
  })) << test::open_descriptors()
      << " descriptors, " << before << " before";
}

TEST_F(AcceptorTest, AFloodIsClosedWhileAnHonestConnectionStays) {
  start();
  RawSocket honest = good_client("127.0.0.2");
  RawSocket flooder = good_client();
  ASSERT_TRUE(wait_until([&] { return taken() == 2; }));
  std::thread reader([&] {
    char bytes[65536];
    std::set<int> open = taken_;
    while (table_.counters().ended == 0)
      for (const int descriptor : open)
        while (recv(descriptor, bytes, sizeof bytes, MSG_DONTWAIT) > 0) {
        }
  });
  const std::string pings = std::string(64 * 1024, 'p');
  EXPECT_TRUE(wait_until([&] { return !flooder.send_some(pings); }));
  reader.join();
  EXPECT_EQ(guard_.closed(), 1u);
  EXPECT_TRUE(honest.discard());
}

TEST_F(AcceptorTest, AfterStoppingNobodyConnectsButConnectionsStay) {
  start();
  RawSocket kept = good_client();
  ASSERT_TRUE(wait_until([&] { return taken() == 1; }));
  RawSocket opening = client();
  ASSERT_TRUE(wait_until([&] { return table_.counters().accepted == 2; }));
  acceptor_->stop_accepting();
  EXPECT_FALSE(RawSocket(port_).connected());
  EXPECT_TRUE(opening.wait_closed());
  EXPECT_TRUE(kept.discard());
  EXPECT_EQ(table_.size(), 1u);
}

TEST_F(AcceptorTest, AUnixConnectionHasAUserIdAndIsFoundByItsDescriptor) {
  const test::TemporaryFolder folder;
  start({}, "unix:" + folder.file("socket"));
  RawSocket local(folder.file("socket"));
  EXPECT_TRUE(local.send(kHttp2Opening));
  ASSERT_TRUE(wait_until([&] { return taken() == 1; }));
  EXPECT_EQ(table_.find("fd:" + std::to_string(*taken_.begin()))->peer().uid, getuid());
  end_taken();
  EXPECT_TRUE(wait_until([&] { return table_.size() == 0; }));
}

// A proxy in front of the server opens the connections of all its clients as one user. If misuse counted against this
// user, one client could keep out the others.
TEST_F(AcceptorTest, AUnixConnectionThatWasClosedForMisuseKeepsOutNoOther) {
  AcceptorOptions options;
  options.limits.new_per_second = 1;
  options.limits.burst = 3;
  const test::TemporaryFolder folder;
  start(options, "unix:" + folder.file("socket"));
  for (int i = 0; i < 2; ++i) {
    RawSocket misused(folder.file("socket"));
    EXPECT_TRUE(misused.send(kHttp2Opening));
    ASSERT_TRUE(wait_until([&] { return taken() == 1; }));
    table_.find("fd:" + std::to_string(*taken_.begin()))->close("misuse");
    end_taken();
    ASSERT_TRUE(wait_until([&] { return table_.size() == 0; }));
  }
  RawSocket other(folder.file("socket"));
  EXPECT_TRUE(other.send(kHttp2Opening));
  EXPECT_TRUE(wait_until([&] { return taken() == 1; }));
  EXPECT_EQ(refused(), 0u);
}

TEST_F(AcceptorTest, AConnectionThatIsClosedWithoutMisuseDoesNotChargeItsAddress) {
  AcceptorOptions options;
  options.limits.new_per_second = 1;
  options.limits.burst = 3;
  start(options);
  for (int i = 0; i < 2; ++i) {
    RawSocket closed = good_client();
    ASSERT_TRUE(wait_until([&] { return taken() == 1; }));
    table_.close_if([](const Connection&) { return true; }, "no longer trusted");
    end_taken();
    ASSERT_TRUE(wait_until([&] { return table_.size() == 0; }));
  }
  RawSocket other = good_client();
  EXPECT_TRUE(wait_until([&] { return taken() == 1; }));
  EXPECT_EQ(refused(), 0u);
}

TEST_F(AcceptorTest, WithoutFreeDescriptorsConnectionsWaitAndTheThreadPauses) {
  start();
  RawSocket waiting(port_);  // the client's end and the server's end each need a descriptor
  ASSERT_TRUE(wait_until([&] { return table_.counters().accepted == 1; }));
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  const int free_descriptor = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port_));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const rlimit none{0, limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  EXPECT_EQ(connect(free_descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_EQ(table_.counters().accepted, 1u);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
  EXPECT_TRUE(wait_until([&] { return table_.counters().accepted == 2; }));
  close(free_descriptor);
}

}  // namespace
}  // namespace locus::server
