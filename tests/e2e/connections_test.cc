#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include "server/connections/frame_check.h"
#include "tests/support/raw_socket.h"
#include "tests/support/rpc_test.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text_of.h"

namespace locus::test {
namespace {

enum Frame : uint8_t { kData = 0, kHeaders = 1, kReset = 3, kSettings = 4, kPing = 6, kContinuation = 9 };
constexpr uint8_t kEndStream = 1;
constexpr uint8_t kEndHeaders = 4;

// Returns a header field in HPACK, without compression and without the dynamic table. Source: RFC 7541, section 6.2.2.
std::string header(const std::string& name, const std::string& value) {
  std::string text(1, '\0');
  text += static_cast<char>(name.size());
  text += name;
  text += static_cast<char>(value.size());
  return text + value;
}

std::string headers_of(const std::string& method) {
  return header(":method", "POST") + header(":scheme", "http") + header(":path", method) +
         header(":authority", "here") + header("te", "trailers") + header("content-type", "application/grpc");
}

server::ServerConfig many_connections() {
  server::ServerConfig config = test_config();
  config.max_new_connections = 100'000;
  config.max_connections_per_address = 100'000;
  return config;
}

// A server that a test attacks, and a client on another connection that must be served all the time.
class ConnectionsTest : public RpcTest {
 protected:
  ConnectionsTest() : RpcTest(many_connections()) {}

  int port() { return running_.server().port(); }
  // Returns a connection that has begun HTTP/2.
  RawSocket opened() {
    RawSocket made(port());
    EXPECT_TRUE(made.send(kHttp2Opening + http2_frame(kSettings, 1, 0, "")));
    return made;
  }
  bool victim_is_served() { return query(ray_along_x()).ok(); }
  // Returns the limit `name` as GetServer lists it. If it is not listed, fails the test and returns an empty limit.
  v1::Limit limit(const std::string& name) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::GetServerResponse response;
    EXPECT_TRUE(stubs().server->GetServer(&context, {}, &response).ok());
    for (const v1::Limit& listed : response.limits())
      if (listed.name() == name) return listed;
    ADD_FAILURE() << "no limit " << name;
    return {};
  }

  // Sends `bytes` again and again until the server closes the connection. Returns false if the server does not close
  // it.
  bool flood(const std::string& bytes, RawSocket attacker) {
    return wait_until([&] {
      for (int i = 0; i < 50; ++i)
        if (!attacker.send_some(bytes) || !attacker.discard()) return true;
      EXPECT_TRUE(victim_is_served());
      return false;
    });
  }
  static std::string repeated(const std::string& frame, size_t times) {
    std::string all;
    for (size_t i = 0; i < times; ++i) all += frame;
    return all;
  }
};

TEST_F(ConnectionsTest, AFloodOfPingsIsClosed) {
  EXPECT_TRUE(flood(repeated(http2_frame(kPing, 1, 0, std::string(8, 'x')), 4000), opened()));
  EXPECT_TRUE(victim_is_served());
}

TEST_F(ConnectionsTest, AFloodOfSettingsIsClosed) {
  EXPECT_TRUE(flood(repeated(http2_frame(kSettings, 1, 0, ""), 4000), opened()));
  EXPECT_TRUE(victim_is_served());
}

TEST_F(ConnectionsTest, AFloodOfEmptyDataIsClosed) {
  RawSocket attacker = opened();
  EXPECT_TRUE(attacker.send(http2_frame(kHeaders, kEndHeaders, 1, headers_of("/locus.v1.QueryService/StreamQueries"))));
  EXPECT_TRUE(flood(repeated(http2_frame(kData, 0, 1, ""), 4000), std::move(attacker)));
  EXPECT_TRUE(victim_is_served());
}

TEST_F(ConnectionsTest, AFloodOfContinuationsIsClosed) {
  RawSocket attacker = opened();
  EXPECT_TRUE(attacker.send(http2_frame(kHeaders, 0, 1, headers_of("/locus.v1.QueryService/Query"))));
  const std::string part = http2_frame(kContinuation, 0, 1, header("name", std::string(100, 'v')));
  EXPECT_TRUE(flood(repeated(part, 500), std::move(attacker)));
  EXPECT_TRUE(victim_is_served());
}

// The block of headers stays far below the limits of the flood guard, so only the check of headers can close the
// connection.
TEST_F(ConnectionsTest, ABlockOfHeadersThatIsTooLongClosesItsConnectionAtOnce) {
  const std::string begin = http2_frame(kHeaders, 0, 1, headers_of("/locus.v1.QueryService/Query"));
  const std::string part = http2_frame(kContinuation, 0, 1, header("name", std::string(100, 'v')));
  RawSocket honest = opened();
  EXPECT_TRUE(honest.send(begin + repeated(part, server::FrameCheck::kMaxContinuations)));
  RawSocket attacker = opened();
  EXPECT_TRUE(attacker.send(begin));
  attacker.send(repeated(part, server::FrameCheck::kMaxContinuations + 1));
  EXPECT_TRUE(wait_until([&] { return !attacker.discard(); }));
  EXPECT_EQ(limit("header_bytes").value(), server::FrameCheck::kMaxBlockBytes);
  EXPECT_EQ(limit("header_bytes").refused(), 1u);
  EXPECT_TRUE(honest.discard()) << "the older connection, which is as silent, must still be open";
  EXPECT_TRUE(victim_is_served());
}

TEST_F(ConnectionsTest, RapidResetsAreClosed) {
  RawSocket attacker = opened();
  uint32_t stream = 1;
  const std::string headers = headers_of("/locus.v1.QueryService/StreamQueries");
  EXPECT_TRUE(wait_until([&] {
    std::string calls;
    for (int i = 0; i < 200; ++i, stream += 2)
      calls +=
          http2_frame(kHeaders, kEndHeaders, stream, headers) + http2_frame(kReset, 0, stream, std::string(4, '\x8'));
    return !attacker.send(calls) || !attacker.discard();
  }));
  EXPECT_TRUE(victim_is_served());
}

TEST_F(ConnectionsTest, DescriptorsComeBackAfterTwoThousandConnections) {
  ASSERT_TRUE(victim_is_served());
  const size_t before = open_descriptors();
  for (int i = 0; i < 2000; ++i) {
    RawSocket visitor(port());
    if (i % 3 == 0) visitor.send("\x16\x03\x01 garbage");
    if (i % 3 == 1) visitor.send(kHttp2Opening + "garbage after the preface");
  }
  EXPECT_TRUE(wait_until([&] { return open_descriptors() == before; })) << open_descriptors() << ", before " << before;
  EXPECT_TRUE(victim_is_served());
}

TEST_F(ConnectionsTest, SmallCallsManyStreamsAndLargeMessagesAreNotClosed) {
  Stubs stubs(running_.address());  // all callers share this connection
  std::atomic<bool> end{false};
  std::vector<std::thread> callers;
  std::atomic<int> failed{0};
  for (int i = 0; i < 4; ++i)
    callers.emplace_back([&] {
      while (!end.load()) {
        grpc::ClientContext context;
        set_timeout(context);
        context.AddMetadata("x-long", std::string(4000, 'm'));
        v1::QueryRequest request;
        request.set_scene("world");
        *request.mutable_batch() = ray_along_x();
        v1::QueryResponse response;
        failed += stubs.queries->Query(&context, request, &response).ok() ? 0 : 1;
      }
    });
  for (int i = 0; i < 8; ++i) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::UploadMeshResponse response;
    const auto writer = stubs.scenes->UploadMesh(&context, &response);
    v1::UploadMeshRequest message = whole_mesh("cube" + std::to_string(i));
    message.set_vertex_count(2'000'000);
    message.mutable_vertices()->Resize(6'000'000, 1.5f);
    EXPECT_TRUE(writer->Write(message));
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    EXPECT_NE(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
  }
  end.store(true);
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(failed.load(), 0);
}

TEST_F(ConnectionsTest, ASilentOrWrongClientIsNotHandedToGrpc) {
  RawSocket wrong(port());
  EXPECT_TRUE(wrong.send("GET / HTTP/1.1\r\nHost: here\r\n\r\n"));
  EXPECT_TRUE(wrong.wait_closed());
  EXPECT_TRUE(victim_is_served());
}

class ConnectionLimitsTest : public ::testing::Test {
 protected:
  // Returns how many connections the limit `name` has refused, according to GetServer.
  static uint64_t refused_by(Stubs& stubs, const std::string& name) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::GetServerResponse response;
    EXPECT_TRUE(stubs.server->GetServer(&context, {}, &response).ok());
    for (const v1::Limit& limit : response.limits())
      if (limit.name() == name) return limit.refused();
    ADD_FAILURE() << "no limit " << name;
    return 0;
  }
  static bool served(Stubs& stubs, std::chrono::milliseconds timeout) {
    grpc::ClientContext context;
    set_timeout(context, timeout);
    v1::GetServerResponse response;
    return stubs.server->GetServer(&context, {}, &response).ok();
  }
};

TEST_F(ConnectionLimitsTest, AnAddressHasAMaximumOfConnectionsAndIsServedAgainWhenOneEnds) {
  server::ServerConfig config = test_config();
  config.max_connections_per_address = 3;
  RunningServer running(config);
  ASSERT_TRUE(served(running.stubs(), kCallTimeout));
  auto second = std::make_unique<RawSocket>(running.server().port());
  RawSocket third(running.server().port());
  Stubs excess(running.address());
  EXPECT_FALSE(served(excess, std::chrono::milliseconds(500)));
  EXPECT_GE(refused_by(running.stubs(), "connections_per_address"), 1u);
  second.reset();
  EXPECT_TRUE(wait_until([&] { return served(excess, std::chrono::seconds(2)); }));
  EXPECT_TRUE(served(running.stubs(), kCallTimeout));
}

TEST_F(ConnectionLimitsTest, NewConnectionsOfAnAddressAreLimitedWhileItsOldOnesAreServed) {
  server::ServerConfig config = test_config();
  config.max_new_connections = 1;
  RunningServer running(config);
  ASSERT_TRUE(served(running.stubs(), kCallTimeout));
  int refused = 0;
  for (int i = 0; i < 30; ++i) {
    RawSocket visitor(running.server().port());
    if (visitor.answers(kHttp2Opening)) continue;
    ++refused;
  }
  EXPECT_GT(refused, 10);
  EXPECT_GE(refused_by(running.stubs(), "new_connections_per_s"), 10u);
  EXPECT_TRUE(served(running.stubs(), kCallTimeout));
}

TEST_F(ConnectionLimitsTest, RefusedAndClosedConnectionsAreAuditedInAFewLines) {
  const TemporaryFolder folder;
  server::ServerConfig config = test_config();
  config.max_new_connections = 50;
  config.audit_file = folder.file("audit");
  {
    RunningServer running(config);
    ASSERT_TRUE(served(running.stubs(), kCallTimeout));
    RawSocket flooding(running.server().port());
    std::string pings = kHttp2Opening;
    for (int i = 0; i < 3000; ++i) pings += http2_frame(kPing, 0, 0, "12345678");
    flooding.send(pings);
    EXPECT_TRUE(wait_until([&] { return !flooding.discard(); }));
    for (int i = 0; i < 300; ++i) {
      RawSocket wrong(running.server().port());
      wrong.send("GET / HTTP/1.1\r\n\r\n");
      wrong.wait_closed();
    }
    const auto audited = [&] { return text_of(folder.file("audit.refused")); };
    EXPECT_TRUE(wait_until([&] { return audited().find("refused: max-new-connections") != std::string::npos; }));
  }
  const std::string audit = text_of(folder.file("audit.refused"));
  EXPECT_THAT(audit, ::testing::HasSubstr(R"("peer":"ipv4:127.0.0.1:)"));
  EXPECT_THAT(audit, ::testing::HasSubstr("closed: too many frames that carry nothing"));
  EXPECT_THAT(audit, ::testing::HasSubstr(" connections; the last of them: refused: "));
  EXPECT_LT(std::count(audit.begin(), audit.end(), '\n'), 40);
}

TEST_F(ConnectionLimitsTest, CallsOverUnixSocketsAreServedAndTheFileIsRemovedAtTheEnd) {
  const TemporaryFolder folder;
  const std::string path = folder.file("socket");
  server::ServerConfig config = test_config();
  config.listen = {"unix:" + path};
  {
    RunningServer running(config);
    Stubs second(running.address());
    EXPECT_TRUE(served(running.stubs(), kCallTimeout));
    EXPECT_TRUE(served(second, kCallTimeout));
    running.server().drain(std::chrono::milliseconds(100));
  }
  EXPECT_NE(access(path.c_str(), F_OK), 0);
}

}  // namespace
}  // namespace locus::test
