// Readers that pin more memory of a scene than permitted: the server cancels the readers, and updates wait only until
// the cancelled readers have ended.
#include <algorithm>
#include <atomic>
#include <thread>

#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

constexpr uint64_t kPinnedLimit = 4096;

server::ServerConfig with_little() {
  server::ServerConfig config = test_config();
  config.pinned_limit = kPinnedLimit;
  return config;
}

class PinnedRpcTest : public RpcTest {
 protected:
  PinnedRpcTest() : RpcTest(with_little()) {}

  // Returns a batch that inserts objects 1 to `count`, all at one position.
  static v1::UpdateBatch insert_heap(uint64_t count) {
    v1::UpdateBatch batch = insert_balls(1, count);
    batch.mutable_inserts(0)->clear_positions();
    batch.mutable_inserts(0)->mutable_positions()->Resize(static_cast<int>(3 * count), 0.0f);
    return batch;
  }
  static v1::UpdateBatch move_heap(uint64_t count, float to) {
    v1::UpdateBatch batch;
    v1::Move* move = batch.add_moves();
    for (uint64_t id = 1; id <= count; ++id) move->add_ids(id);
    move->mutable_positions()->Resize(static_cast<int>(3 * count), to);
    return batch;
  }
};

TEST_F(PinnedRpcTest, ABatchThatPinsTooMuchIsCancelledAndUpdatesContinue) {
  constexpr uint64_t kObjects = 4'000;
  ASSERT_TRUE(apply(insert_heap(kObjects)).ok());
  // The batch would take seconds if it were not cancelled.
  v1::QueryBatch batch;
  v1::QueryBlock* block = batch.add_blocks();
  block->set_max_results(1);
  block->mutable_balls()->mutable_centers()->Resize(3 * limits::kMaxQueries, 0.0f);
  block->mutable_balls()->add_radii(10);
  std::atomic<bool> ended{false};
  std::thread reader([&] {
    const grpc::Status status = query(batch);
    ended = true;
    expect_refused(status, {grpc::StatusCode::RESOURCE_EXHAUSTED, v1::REASON_LIMIT, ""});
    EXPECT_EQ(error_of(status).limit(), "pinned_bytes");
    EXPECT_EQ(error_of(status).limit_value(), kPinnedLimit);
    EXPECT_GT(error_of(status).asked(), kPinnedLimit);
  });
  uint64_t updates = 0;
  while (!ended) {
    ++updates;
    ASSERT_TRUE(apply(move_heap(kObjects, float(updates % 2))).ok());
  }
  reader.join();
  EXPECT_EQ(get("world").revision(), 1 + updates);
  EXPECT_EQ(get("world").pinned_bytes(), 0u);
}

TEST_F(PinnedRpcTest, ADumpThatIsNotReadIsCancelledAndUpdatesContinue) {
  constexpr uint64_t kObjects = 300'000;  // more than a connection buffers for a caller that does not read
  ASSERT_TRUE(apply(insert_heap(kObjects)).ok());
  v1::DumpSceneRequest request;
  request.set_scene("world");
  grpc::ClientContext context;
  set_timeout(context);
  const auto reader = stubs().scenes->DumpScene(&context, request);
  v1::DumpSceneResponse piece;
  ASSERT_TRUE(reader->Read(&piece));
  ASSERT_TRUE(apply(move_heap(kObjects, 1)).ok());
  ASSERT_TRUE(apply(move_heap(kObjects, 2)).ok());
  ASSERT_TRUE(apply(move_heap(kObjects, 3)).ok());
  while (reader->Read(&piece)) {
  }
  // The call ends with RESOURCE_EXHAUSTED if it notices the revoked pin before its cancellation takes effect; otherwise
  // it ends with CANCELLED.
  EXPECT_THAT(reader->Finish().error_code(),
              testing::AnyOf(grpc::StatusCode::CANCELLED, grpc::StatusCode::RESOURCE_EXHAUSTED));
}

TEST_F(PinnedRpcTest, TheLimitIsListedAndASceneReportsItsOwn) {
  EXPECT_EQ(get("world").max_pinned_bytes(), kPinnedLimit);
  v1::GetServerResponse server;
  ASSERT_TRUE(call(*stubs().server, &v1::ServerService::Stub::GetServer, v1::GetServerRequest(), &server).ok());
  const auto listed = std::find_if(server.limits().begin(), server.limits().end(),
                                   [](const v1::Limit& limit) { return limit.name() == "pinned_bytes"; });
  ASSERT_NE(listed, server.limits().end());
  EXPECT_EQ(listed->value(), kPinnedLimit);
}

}  // namespace
}  // namespace locus::test
