#include "server/rpc/stream_counter.h"

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/support/raw_socket.h"

namespace locus::server {
namespace {

using std::chrono::seconds;
using std::chrono::system_clock;

// A server that accepts only the first call of its client, and answers no call.
class StreamCounterTest : public ::testing::Test {
 protected:
  struct Stream {
    grpc::ClientContext context;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call;
  };

  void SetUp() override {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.AddChannelArgument(GRPC_ARG_ENABLE_CHANNELZ, 1);
    builder.RegisterAsyncGenericService(&service_);
    server_queue_ = builder.AddCompletionQueue();
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
    service_.RequestCall(&accepted_, &accepted_call_, server_queue_.get(), server_queue_.get(), this);
    stub_ = std::make_unique<grpc::GenericStub>(
        grpc::CreateChannel(absl::StrCat("127.0.0.1:", port), grpc::InsecureChannelCredentials()));
  }

  void TearDown() override {
    streams_.clear();
    server_->Shutdown(system_clock::now());
    for (grpc::CompletionQueue* queue : {static_cast<grpc::CompletionQueue*>(server_queue_.get()), &client_queue_}) {
      queue->Shutdown();
      void* tag = nullptr;
      bool ok = false;
      while (queue->Next(&tag, &ok)) {
      }
    }
  }

  void begin_streams(int count) {
    for (int i = 0; i < count; ++i) {
      streams_.push_back(std::make_unique<Stream>());
      Stream& stream = *streams_.back();
      stream.call = stub_->PrepareCall(&stream.context, "/some/method", &client_queue_);
      stream.call->StartCall(&stream);
      EXPECT_TRUE(event_of(client_queue_));
    }
  }

  static bool event_of(grpc::CompletionQueue& queue) {
    void* tag = nullptr;
    bool ok = false;
    return queue.AsyncNext(&tag, &ok, system_clock::now() + seconds(20)) == grpc::CompletionQueue::GOT_EVENT;
  }

  grpc::AsyncGenericService service_;
  std::unique_ptr<grpc::ServerCompletionQueue> server_queue_;
  std::unique_ptr<grpc::Server> server_;
  grpc::GenericServerContext accepted_;
  grpc::GenericServerAsyncReaderWriter accepted_call_{&accepted_};
  grpc::CompletionQueue client_queue_;
  std::unique_ptr<grpc::GenericStub> stub_;
  std::vector<std::unique_ptr<Stream>> streams_;
  ConnectionTable table_;
};

TEST_F(StreamCounterTest, CountsStreamsWhoseCallsNobodyHasAccepted) {
  begin_streams(1);
  ASSERT_TRUE(event_of(*server_queue_));
  const std::shared_ptr<Connection> connection = table_.find(accepted_.peer());
  StreamCounter counter(table_);
  EXPECT_EQ(counter.count(*connection), 1u);
  begin_streams(4);
  EXPECT_TRUE(test::wait_until([&] { return counter.count(*connection) == 5u; }));
}

TEST_F(StreamCounterTest, AConnectionThatGrpcDoesNotKnowHasNoCount) {
  const std::shared_ptr<Connection> connection = table_.find("ipv4:127.0.0.1:1");
  StreamCounter counter(table_);
  EXPECT_EQ(counter.count(*connection), std::nullopt);
}

}  // namespace
}  // namespace locus::server
