// Messages that clients compress: refused, or inflated within the limit of a message's size.
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

server::ServerConfig accepting() {
  server::ServerConfig config = test_config();
  config.accept_compression = true;
  return config;
}

v1::ApplyUpdatesRequest update_of(uint64_t last_id) {
  v1::ApplyUpdatesRequest request;
  request.set_scene("world");
  *request.mutable_batch() = insert_balls(1, last_id);
  return request;
}

grpc::Status apply_compressed(Stubs& stubs, const v1::ApplyUpdatesRequest& request,
                              grpc_compression_algorithm algorithm, v1::ApplyUpdatesResponse& response) {
  grpc::ClientContext context;
  set_timeout(context);
  context.set_compression_algorithm(algorithm);
  return stubs.updates->ApplyUpdates(&context, request, &response);
}

class CompressionTest : public RpcTest {
 protected:
  CompressionTest() : RpcTest(accepting()) {}
};

class NoCompressionTest : public RpcTest {};

TEST_F(NoCompressionTest, CompressedMessagesAreRefused) {
  v1::ApplyUpdatesResponse response;
  for (const grpc_compression_algorithm algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    const grpc::Status status = apply_compressed(running_.stubs(), update_of(1000), algorithm, response);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED) << status.error_message();
  }
}

TEST_F(CompressionTest, GzipIsInflatedAndDeflateIsRefused) {
  v1::ApplyUpdatesResponse response;
  const grpc::Status gzip = apply_compressed(running_.stubs(), update_of(1000), GRPC_COMPRESS_GZIP, response);
  EXPECT_TRUE(gzip.ok()) << gzip.error_message();
  EXPECT_EQ(response.ack().applied(), 1000u);
  const grpc::Status plain = apply_compressed(running_.stubs(), update_of(1000), GRPC_COMPRESS_NONE, response);
  EXPECT_TRUE(plain.ok()) << plain.error_message();
  EXPECT_EQ(apply_compressed(running_.stubs(), update_of(1000), GRPC_COMPRESS_DEFLATE, response).error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(CompressionTest, StreamsAndBlockingCallsInflateToo) {
  grpc::ClientContext context;
  set_timeout(context);
  context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  const auto stream = running_.stubs().updates->StreamUpdates(&context);
  for (uint64_t i = 0; i < 3; ++i) {
    v1::StreamUpdatesRequest request;
    request.set_scene("world");
    *request.mutable_batch() = insert_balls(1000 * i + 1, 1000 * i + 1000);
    ASSERT_TRUE(stream->Write(request));
    v1::StreamUpdatesResponse response;
    ASSERT_TRUE(stream->Read(&response));
    EXPECT_EQ(response.ack().applied(), 1000u);
  }
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
  grpc::ClientContext create;
  set_timeout(create);
  create.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  v1::CreateSceneRequest request;
  request.set_name("a-name-that-is-long-enough-that-gzip-makes-it-smaller-aaaaaaaa");
  v1::CreateSceneResponse response;
  const grpc::Status created = running_.stubs().scenes->CreateScene(&create, request, &response);
  EXPECT_TRUE(created.ok()) << created.error_message();
}

TEST_F(CompressionTest, AMessageThatInflatesBeyondTheReceiveLimitIsRefusedByName) {
  v1::QueryRequest request;
  request.set_scene("world");
  v1::Rays* rays = request.mutable_batch()->add_blocks()->mutable_rays();
  rays->mutable_origins()->Resize(10 << 20, 0.0f);  // 40 MiB
  grpc::ClientContext context;
  set_timeout(context);
  context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  v1::QueryResponse response;
  const grpc::Status status = running_.stubs().queries->Query(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("receive_bytes"));
}

}  // namespace
}  // namespace locus::test
