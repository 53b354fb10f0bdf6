// Tests of calls whose handlers block, with callers that send no message or do not read the response.
#include "server/rpc/blocking_calls.h"

#include <gtest/gtest.h>

#include <functional>
#include <list>

#include "locus/v1/server_service.pb.h"
#include "tests/support/raw_call.h"
#include "tests/support/rpc_test.h"
#include "tests/support/silent_call.h"

namespace locus::test {
namespace {

using server::BlockingCalls;
using server::BlockingMethod;
using server::Caller;
using server::IoThreads;
using server::RpcState;

constexpr const char* kSmall = "/test.Service/Small";
constexpr const char* kLargeReply = "/test.Service/Bulky";  // its response fits no flow control window
constexpr size_t kLargeReplyBytes = 3u << 20;
constexpr uint32_t kMaxCalls = 2;

// A server with the methods kSmall and kLargeReply, and a client with one connection. The server accepts at most
// kMaxCalls calls of one connection.
class BlockingCallsTest : public ::testing::Test {
 protected:
  BlockingCallsTest() {
    calls_.add({method(kSmall, 1), method(kLargeReply, kLargeReplyBytes)});
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterAsyncGenericService(&calls_.service());
    io_ = std::make_unique<IoThreads>(builder, 2);
    server_ = builder.BuildAndStart();
    calls_.listen(*io_);
    io_->start();
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);  // flow control windows that do not grow
    channel_ =
        grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials(), arguments);
  }
  ~BlockingCallsTest() override {
    silent_.clear();
    state_.drain.end();
    server_->Shutdown(std::chrono::system_clock::now());
    io_->stop();
  }

  static BlockingMethod method(const char* path, size_t bytes) {
    BlockingMethod served;
    served.path = path;
    served.body = server::unary_body<v1::GetServerRequest, v1::GetServerResponse>(
        [bytes](const Caller&, const v1::GetServerRequest&, v1::GetServerResponse& response) {
          response.set_version(std::string(bytes, 'x'));
          return absl::OkStatus();
        });
    return served;
  }

  void wait_until(const std::function<bool()>& reached) {
    for (int tries = 0; tries < 6000 && !reached(); ++tries) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(reached());
  }
  uint64_t claimed() const { return state_.memory.claimed(server::MemoryLine::kReplies); }

  RpcState state_{kMaxCalls, 1, limits::kMaxMemory, [] { return 0; }};
  BlockingCalls calls_{state_, 16};
  std::unique_ptr<IoThreads> io_;
  std::unique_ptr<grpc::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::list<SilentCall> silent_;
};

TEST_F(BlockingCallsTest, ACallTakesAPermitOnlyWhenItsMessageHasArrived) {
  for (uint32_t i = 0; i < 4 * kMaxCalls; ++i) silent_.emplace_back(channel_, kSmall);
  EXPECT_TRUE(raw_call(channel_, kSmall, "").status.ok());
  for (SilentCall& call : silent_) {
    call.send();
    EXPECT_TRUE(call.finish().ok());
  }
}

TEST_F(BlockingCallsTest, ACallWhoseMessageDoesNotComeEnds) {
  state_.stall_limit = std::chrono::milliseconds(1);
  silent_.emplace_back(channel_, kSmall);
  const grpc::Status status = silent_.back().finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_FALSE(status.error_message().empty());
}

TEST_F(BlockingCallsTest, AnAnswerThatNobodyReadsKeepsNoPermit) {
  for (uint32_t i = 0; i < 4 * kMaxCalls; ++i) {
    silent_.emplace_back(channel_, kLargeReply).send();
    wait_until([&] { return claimed() >= (i + 1) * kLargeReplyBytes && state_.calls.used() == 0; });
  }
  EXPECT_TRUE(raw_call(channel_, kSmall, "").status.ok());
}

TEST_F(BlockingCallsTest, AnAnswerThatNobodyReadsReturnsItsMemoryAfterAWhile) {
  state_.stall_limit = std::chrono::milliseconds(1);
  silent_.emplace_back(channel_, kLargeReply).send();
  wait_until([&] { return claimed() >= kLargeReplyBytes; });
  wait_until([&] { return claimed() == 0; });
}

}  // namespace
}  // namespace locus::test
