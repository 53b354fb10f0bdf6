#include <map>
#include <thread>

#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using UpdateStream = grpc::ClientReaderWriter<v1::StreamUpdatesRequest, v1::StreamUpdatesResponse>;

class StreamRpcTest : public RpcTest {
 protected:
  static v1::StreamUpdatesRequest update(const std::string& scene, uint64_t sequence, const v1::UpdateBatch& batch) {
    v1::StreamUpdatesRequest request;
    request.set_scene(scene);
    request.set_sequence(sequence);
    *request.mutable_batch() = batch;
    return request;
  }

  static v1::StreamQueriesRequest ask(const std::string& scene, uint64_t sequence, const v1::QueryBatch& batch) {
    v1::StreamQueriesRequest request;
    request.set_scene(scene);
    request.set_sequence(sequence);
    *request.mutable_batch() = batch;
    return request;
  }
};

TEST_F(StreamRpcTest, EveryMessageIsAnsweredUnderItsSequenceNumber) {
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().updates->StreamUpdates(&context);
  v1::StreamUpdatesResponse response;
  for (uint64_t i = 1; i <= 10; ++i) {
    ASSERT_TRUE(stream->Write(update(i == 1 ? "world" : "", 100 + i, insert_balls(i, i))));
    ASSERT_TRUE(stream->Read(&response));
    EXPECT_EQ(response.sequence(), 100 + i);
    EXPECT_EQ(response.ack().revision(), i);
  }
  stream->WritesDone();
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(StreamRpcTest, ARefusedMessageIsAnsweredByAnErrorAndTheStreamContinues) {
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().updates->StreamUpdates(&context);
  v1::UpdateBatch wrong = insert_balls(1, 1);
  wrong.mutable_inserts(0)->add_positions(0);
  v1::StreamUpdatesResponse response;
  ASSERT_TRUE(stream->Write(update("world", 1, wrong)));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.sequence(), 1u);
  expect_error(response.error(),
               {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_COLUMN_LENGTH, "inserts[0].positions"});
  ASSERT_TRUE(stream->Write(update("", 2, insert_balls(1, 1))));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.ack().applied(), 1u);
  ASSERT_TRUE(stream->Write(update("other", 3, insert_balls(2, 2))));
  ASSERT_TRUE(stream->Read(&response));
  expect_error(response.error(), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "scene"});
  ASSERT_TRUE(stream->Write(update("world", 4, insert_balls(2, 2))));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.ack().applied(), 1u);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(StreamRpcTest, AStreamOutlivesItsScene) {
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().updates->StreamUpdates(&context);
  v1::StreamUpdatesResponse response;
  ASSERT_TRUE(stream->Write(update("later", 1, insert_balls(1, 1))));
  ASSERT_TRUE(stream->Read(&response));
  expect_error(response.error(), {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "scene"});
  ASSERT_TRUE(create("later").ok());
  ASSERT_TRUE(stream->Write(update("", 2, insert_balls(1, 1))));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.ack().revision(), 1u);
  const uint64_t epoch = response.ack().epoch();
  ASSERT_TRUE(remove("later").ok());
  ASSERT_TRUE(create("later").ok());
  ASSERT_TRUE(stream->Write(update("", 3, insert_balls(1, 1))));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_NE(response.ack().epoch(), epoch);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(StreamRpcTest, TheFirstMessageMustNameAScene) {
  const Refused malformed{grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "scene"};
  for (const char* name : {"", "Not A Name"}) {
    grpc::ClientContext context;
    set_timeout(context);
    const auto stream = stubs().updates->StreamUpdates(&context);
    stream->Write(update(name, 1, {}));
    v1::StreamUpdatesResponse response;
    EXPECT_FALSE(stream->Read(&response));
    expect_refused(stream->Finish(), malformed);
    grpc::ClientContext query_context;
    set_timeout(query_context);
    const auto queries = stubs().queries->StreamQueries(&query_context);
    queries->Write(ask(name, 1, {}));
    v1::StreamQueriesResponse answer;
    EXPECT_FALSE(queries->Read(&answer));
    expect_refused(queries->Finish(), malformed);
  }
}

TEST_F(StreamRpcTest, MetadataMustNameTheStreamsScene) {
  for (const std::string name : {"world", "other"}) {
    grpc::ClientContext context;
    set_timeout(context);
    context.AddMetadata("x-scene", name);
    const auto stream = stubs().queries->StreamQueries(&context);
    stream->Write(ask("world", 1, {}));
    stream->WritesDone();
    v1::StreamQueriesResponse response;
    EXPECT_EQ(stream->Read(&response), name == "world");
    const grpc::Status status = stream->Finish();
    if (name == "world")
      EXPECT_TRUE(status.ok());
    else
      expect_refused(status, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "x-scene"});
  }
}

TEST_F(StreamRpcTest, QueriesAreAnsweredWhileUpdatesStreamIn) {
  constexpr uint64_t kMessages = 200;
  grpc::ClientContext update_context;
  set_timeout(update_context);
  const auto updates = stubs().updates->StreamUpdates(&update_context);
  std::thread writer([&updates] {
    for (uint64_t i = 1; i <= kMessages; ++i) EXPECT_TRUE(updates->Write(update("world", i, insert_balls(i, i))));
    updates->WritesDone();
  });
  grpc::ClientContext query_context;
  set_timeout(query_context);
  const auto queries = stubs().queries->StreamQueries(&query_context);
  v1::StreamUpdatesResponse ack;
  uint64_t acked = 0;
  while (updates->Read(&ack)) {
    ++acked;
    ASSERT_EQ(ack.ack().applied(), 1u);
    v1::QueryBatch batch = ray_along_x();
    batch.mutable_view()->set_at_least(ack.ack().revision());
    batch.add_blocks()->mutable_lookup()->add_ids(ack.sequence());
    ASSERT_TRUE(queries->Write(ask("world", ack.sequence(), batch)));
    v1::StreamQueriesResponse answer;
    ASSERT_TRUE(queries->Read(&answer));
    EXPECT_EQ(answer.sequence(), ack.sequence());
    ASSERT_TRUE(answer.has_result()) << answer.ShortDebugString();
    EXPECT_EQ(answer.result().blocks(0).ids(0), 1u);
    EXPECT_EQ(answer.result().blocks(1).ids(0), ack.sequence());
  }
  writer.join();
  EXPECT_EQ(acked, kMessages);
  EXPECT_TRUE(updates->Finish().ok());
  queries->WritesDone();
  EXPECT_TRUE(queries->Finish().ok());
}

TEST_F(StreamRpcTest, StreamsInterleaveAndEveryBatchOfEachIsAppliedOnce) {
  constexpr uint64_t kStreams = 8;
  constexpr uint64_t kMessages = 50;
  std::vector<std::thread> clients;
  for (uint64_t s = 0; s < kStreams; ++s)
    clients.emplace_back([this, s] {
      grpc::ClientContext context;
      set_timeout(context);
      const auto stream = stubs().updates->StreamUpdates(&context);
      for (uint64_t i = 1; i <= kMessages; ++i) {
        const uint64_t id = s * kMessages + i;
        v1::UpdateBatch batch = insert_balls(id, id);
        batch.set_writer(s + 1);
        batch.set_batch(i);
        // Sends every batch twice; the server treats the second copy as a duplicate.
        for (int time = 0; time < 2; ++time) {
          ASSERT_TRUE(stream->Write(update("world", i, batch)));
          v1::StreamUpdatesResponse response;
          ASSERT_TRUE(stream->Read(&response));
          EXPECT_EQ(response.ack().applied(), 1u);
          EXPECT_EQ(response.ack().duplicate(), time == 1);
        }
      }
      stream->WritesDone();
      EXPECT_TRUE(stream->Finish().ok());
    });
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(get("world").objects(), kStreams * kMessages);
  EXPECT_EQ(get("world").revision(), kStreams * kMessages);
}

TEST_F(StreamRpcTest, AWaitOnAStreamEndsAfterASecondAndTheStreamContinues) {
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().queries->StreamQueries(&context);
  v1::QueryBatch batch;
  batch.mutable_view()->set_at_least(99);
  ASSERT_TRUE(stream->Write(ask("world", 1, batch)));
  v1::StreamQueriesResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.sequence(), 1u);
  EXPECT_EQ(response.error().code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  ASSERT_TRUE(stream->Write(ask("", 2, {})));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_TRUE(response.has_result());
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(StreamRpcTest, ACancelledStreamReleasesItsResources) {
  for (int i = 0; i < 20; ++i) {
    grpc::ClientContext context;
    set_timeout(context);
    const auto stream = stubs().updates->StreamUpdates(&context);
    ASSERT_TRUE(stream->Write(update("world", 1, insert_balls(1, 2))));
    // Reads the first answer, which proves that the server has accepted the stream.
    v1::StreamUpdatesResponse response;
    ASSERT_TRUE(stream->Read(&response));
    if (i % 2 == 0) stream->Write(update("world", 2, insert_balls(3, 4)));
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  const auto open_streams = [this] {
    grpc::ClientContext context;
    set_timeout(context);
    v1::GetServerResponse server;
    EXPECT_TRUE(stubs().server->GetServer(&context, {}, &server).ok());
    for (const v1::Limit& limit : server.limits())
      if (limit.name() == "streams") return limit.used();
    return -1.0;
  };
  while (open_streams() > 0) std::this_thread::yield();
  EXPECT_EQ(open_streams(), 0);
}

TEST_F(StreamRpcTest, DrainingEndsIdleStreamsAfterTheirMessagesAreAnswered) {
  grpc::ClientContext update_context;
  set_timeout(update_context);
  const auto updates = stubs().updates->StreamUpdates(&update_context);
  v1::StreamUpdatesResponse ack;
  ASSERT_TRUE(updates->Write(update("world", 1, insert_balls(1, 1))));
  ASSERT_TRUE(updates->Read(&ack));
  grpc::ClientContext query_context;
  set_timeout(query_context);
  const auto queries = stubs().queries->StreamQueries(&query_context);
  v1::StreamQueriesResponse answer;
  ASSERT_TRUE(queries->Write(ask("world", 1, {})));
  ASSERT_TRUE(queries->Read(&answer));
  running_.server().drain(std::chrono::seconds(60));
  EXPECT_FALSE(updates->Read(&ack));
  const v1::Error error = error_of(updates->Finish());
  expect_error(error, {grpc::StatusCode::UNAVAILABLE, v1::REASON_DRAINING, ""});
  EXPECT_GT(error.retry_after_ms(), 0u);
  EXPECT_FALSE(queries->Read(&answer));
  expect_refused(queries->Finish(), {grpc::StatusCode::UNAVAILABLE, v1::REASON_DRAINING, ""});
}

}  // namespace
}  // namespace locus::test
