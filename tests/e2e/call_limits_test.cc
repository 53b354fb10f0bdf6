// Limits of concurrent calls: if a client reaches such a limit, the server refuses further calls of this client only.
#include <list>

#include "grpc/health/v1/health.grpc.pb.h"
#include "server/config/observability_limits.h"
#include "tests/support/http_get.h"
#include "tests/support/rpc_test.h"
#include "tests/support/silent_call.h"

namespace locus::test {
namespace {

constexpr uint32_t kFewCalls = 6;
constexpr uint32_t kFewStreams = 6;

// A server that permits only few calls and streams, and the connection of a second client.
class CallLimitsTest : public RpcTest {
 protected:
  CallLimitsTest()
      : RpcTest([] {
          server::ServerConfig config = test_config();
          config.max_calls = kFewCalls;
          config.max_streams = kFewStreams;
          config.http_listen = "127.0.0.1:0";
          return config;
        }()),
        other_(running_.address()) {}

  // Waits until `count` permits of a limit are used. Reads the metrics, because an RPC would use a permit itself, and
  // so could take the permit that the last call under test needs.
  void wait_until_used(const std::string& limit, uint32_t count) {
    const std::string line = "locus_limit_used{limit=\"" + limit + "\"} " + std::to_string(count) + "\n";
    while (http_get(running_.server().http_port(), "/metrics").body.find(line) == std::string::npos)
      std::this_thread::yield();
  }

  Stubs other_;
};

// A unary call whose answer is not awaited.
struct PendingQuery {
  PendingQuery(v1::QueryService::Stub& stub, const v1::QueryRequest& request) {
    set_timeout(context);
    reader = stub.AsyncQuery(&context, request, &queue);
    reader->Finish(&response, &status, this);
  }
  ~PendingQuery() {
    context.TryCancel();
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    queue.Shutdown();
    queue.Next(&tag, &ok);
  }
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  v1::QueryResponse response;
  grpc::Status status;
  std::unique_ptr<grpc::ClientAsyncResponseReader<v1::QueryResponse>> reader;
};

TEST_F(CallLimitsTest, QueriesThatWaitForARevisionLeaveCallsToOthers) {
  v1::QueryRequest request;
  request.set_scene("world");
  *request.mutable_batch() = ray_along_x();
  request.mutable_batch()->mutable_view()->set_at_least(1000);
  std::list<PendingQuery> waiting;
  for (uint32_t i = 0; i < kFewCalls; ++i) waiting.emplace_back(*stubs().queries, request);
  wait_until_used("calls", kFewCalls);
  const v1::Error error = error_of(query(ray_along_x()));
  EXPECT_EQ(error.limit(), "calls");
  request.mutable_batch()->clear_view();
  v1::QueryResponse response;
  EXPECT_TRUE(call(*other_.queries, &v1::QueryService::Stub::Query, request, &response).ok());
}

TEST_F(CallLimitsTest, SilentStreamsLeaveStreamsToOthers) {
  using Stream = grpc::ClientReaderWriter<v1::StreamQueriesRequest, v1::StreamQueriesResponse>;
  std::list<grpc::ClientContext> contexts;
  std::vector<std::unique_ptr<Stream>> silent;
  for (uint32_t i = 0; i < kFewStreams; ++i) {
    set_timeout(contexts.emplace_back());
    silent.push_back(stubs().queries->StreamQueries(&contexts.back()));
  }
  wait_until_used("streams", kFewStreams);
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = other_.queries->StreamQueries(&context);
  v1::StreamQueriesRequest request;
  request.set_scene("world");
  *request.mutable_batch() = ray_along_x();
  ASSERT_TRUE(stream->Write(request));
  v1::StreamQueriesResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_FALSE(response.has_error());
  stream->WritesDone();
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok());
  for (grpc::ClientContext& silent_context : contexts) silent_context.TryCancel();
}

TEST_F(CallLimitsTest, HealthChecksWithoutAMessageDoNotRefuseProbes) {
  std::list<SilentCall> silent;
  for (uint32_t i = 0; i < 2 * server::kMaxHealthChecks; ++i)
    silent.emplace_back(stubs().channel, "/grpc.health.v1.Health/Check");
  // The server receives these checks after the calls above, because they share a connection.
  const auto health = grpc::health::v1::Health::NewStub(stubs().channel);
  for (int i = 0; i < 10; ++i) {
    grpc::health::v1::HealthCheckResponse response;
    const grpc::Status status = call(*health, &grpc::health::v1::Health::Stub::Check, {}, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
}

}  // namespace
}  // namespace locus::test
