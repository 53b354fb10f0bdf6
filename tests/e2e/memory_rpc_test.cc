#include "server/host/memory_use.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

server::ServerConfig with_memory(uint64_t bytes) {
  server::ServerConfig config = test_config();
  config.memory_limit = bytes;
  return config;
}

// Server whose process already uses more memory than its limit.
class FullMemoryRpcTest : public RpcTest {
 protected:
  FullMemoryRpcTest() : RpcTest(with_memory(1)) {}
};

// Server with memory for small work only.
class ScarceMemoryRpcTest : public RpcTest {
 protected:
  static constexpr uint64_t kRoom = uint64_t{512} << 20;
  ScarceMemoryRpcTest() : RpcTest(with_memory(server::process_memory(Registry()).used() + kRoom)) {}
};

void expect_short(const grpc::Status& status, const std::string& field) {
  expect_refused(status, {grpc::StatusCode::RESOURCE_EXHAUSTED, v1::REASON_LIMIT, field});
  EXPECT_THAT(status.error_message(), ::testing::HasSubstr("limit memory_bytes is "));
}

TEST_F(FullMemoryRpcTest, AnInsertIsRefusedAndChangesNothing) {
  const std::string before = dump();
  expect_short(apply(insert_balls(1, 2)), "inserts");
  EXPECT_EQ(dump(), before);
}

TEST_F(FullMemoryRpcTest, AnUploadIsRefusedAtItsFirstMessage) {
  expect_short(upload({whole_mesh("cube")}), "triangle_count");
}

TEST_F(FullMemoryRpcTest, MovesRemovesAndQueriesAreServed) {
  v1::UpdateBatch batch;
  batch.add_remove_ids(1);
  v1::Move* move = batch.add_moves();
  move->add_ids(2);
  fill(move->mutable_positions(), {0.0f, 0.0f, 0.0f});
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(batch, &ack).ok());
  EXPECT_EQ(ack.refused(), 2u);
  EXPECT_TRUE(query(ray_along_x()).ok());
}

TEST_F(ScarceMemoryRpcTest, SmallWorkIsServedAndTooManyInstancesAreRefused) {
  ASSERT_TRUE(apply(insert_balls(1, 2)).ok());
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  ASSERT_TRUE(change(place_one("cube", 100)).ok());
  v1::ChangeInstancesRequest many = place_one("cube", 0);
  many.mutable_place(0)->mutable_translations()->Resize(3 << 20, 0.0);
  const std::string before = dump();
  expect_short(change(many), "place");
  EXPECT_EQ(dump(), before);
  v1::ChangeInstancesRequest removal;
  removal.set_scene("world");
  removal.add_remove_ids(100);
  EXPECT_TRUE(change(removal).ok());
}

TEST_F(ScarceMemoryRpcTest, TheLimitIsListedWithWhatIsUsed) {
  v1::GetServerResponse server;
  ASSERT_TRUE(call(*stubs().server, &v1::ServerService::Stub::GetServer, v1::GetServerRequest(), &server).ok());
  for (const v1::Limit& limit : server.limits()) {
    if (limit.name() != "memory_bytes") continue;
    EXPECT_GT(limit.value(), kRoom);
    EXPECT_GT(limit.used(), 0);
    return;
  }
  FAIL() << "no limit memory_bytes";
}

}  // namespace
}  // namespace locus::test
