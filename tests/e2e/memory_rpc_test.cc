#include "server/observability/process_figures.h"
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

// Server whose memory limit leaves 512 MiB free.
class ScarceMemoryRpcTest : public RpcTest {
 protected:
  static constexpr uint64_t kRoom = uint64_t{512} << 20;
  ScarceMemoryRpcTest() : RpcTest(with_memory(server::resident_bytes() + kRoom)) {}
};

// Server whose memory limit leaves 128 MiB free, of which one connection may hold half.
class SharedMemoryRpcTest : public RpcTest {
 protected:
  static constexpr uint64_t kRoom = uint64_t{128} << 20;
  SharedMemoryRpcTest() : RpcTest(with_memory(server::resident_bytes() + kRoom)) {}
};

// Server whose memory limit leaves 2 GiB free. One upload takes much less, also with the larger allocations of
// AddressSanitizer. So when many uploads fill the memory, one of them is refused before memory is so full that
// connections are closed.
class RoomyMemoryRpcTest : public RpcTest {
 protected:
  static constexpr uint64_t kRoom = uint64_t{2} << 30;
  RoomyMemoryRpcTest() : RpcTest(with_memory(server::resident_bytes() + kRoom)) {}
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

TEST_F(SharedMemoryRpcTest, OneConnectionMayNotHoldMoreThanItsShare) {
  v1::UpdateBatch many;
  v1::Move* moves = many.add_moves();
  moves->mutable_ids()->Resize(150'000, 1);
  moves->mutable_positions()->Resize(3, 0.0f);
  const grpc::Status status = apply(many);
  expect_refused(status, {grpc::StatusCode::RESOURCE_EXHAUSTED, v1::REASON_LIMIT, "moves"});
  EXPECT_EQ(error_of(status).limit(), "connection_memory_bytes");
  EXPECT_THAT(status.error_message(), ::testing::HasSubstr("of which calls of this connection hold "));
  for (int times = 0; times < 100; ++times) ASSERT_TRUE(query(ray_along_x()).ok()) << "what was refused is not held";
  Stubs others(running_.address());
  grpc::ClientContext context;
  set_timeout(context);
  v1::QueryRequest request;
  request.set_scene("world");
  *request.mutable_batch() = ray_along_x();
  v1::QueryResponse response;
  EXPECT_TRUE(others.queries->Query(&context, request, &response).ok());
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

TEST_F(ScarceMemoryRpcTest, AChangeThatIsNotWaitedForClaimsItsMemoryBeforeItIsChecked) {
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  v1::ChangeInstancesRequest many = place_one("cube", 0);
  many.set_no_wait(true);
  many.mutable_place(0)->mutable_ids()->Resize(1 << 20, 7);  // equal ids, which the check would refuse
  expect_short(change(many), "place");
  many.mutable_place(0)->mutable_ids()->Truncate(2);
  expect_refused(change(many), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_DUPLICATE_ID, "place[0].ids", 1});
}

TEST_F(RoomyMemoryRpcTest, NamesOfKnownBytesAreRefusedWhenTheirPartsNeedTooMuch) {
  CubeMesh large;
  while (large.indices.size() < size_t{3} * limits::kMaxMeshParts)
    large.indices.push_back(large.indices[large.indices.size() % 36]);
  v1::UploadMeshResponse response;
  ASSERT_TRUE(upload({whole_mesh("large", large)}, &response).ok());
  v1::UploadMeshRequest known = whole_mesh("", large);
  known.clear_vertices();
  known.clear_indices();
  known.set_sha256(response.mesh().sha256());
  for (uint32_t part = 0; part < limits::kMaxMeshParts; ++part) {
    known.add_parts()->set_name(std::string(limits::kMaxLabelLength, 'p'));
    known.mutable_parts(static_cast<int>(part))->set_first_triangle(part);
  }
  // The parts of each name take about 20 MB, so that 200 names exceed the memory limit.
  grpc::Status status;
  for (int name = 0; name < 200 && status.ok(); ++name) {
    known.set_mesh("name" + std::to_string(name));
    status = upload({known});
  }
  ASSERT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_EQ(error_of(status).reason(), v1::REASON_LIMIT);
  // The request may exceed the shrinking share of this connection before the parts exceed the memory limit.
  EXPECT_THAT(error_of(status).limit(), ::testing::AnyOf("memory_bytes", "connection_memory_bytes"));
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
