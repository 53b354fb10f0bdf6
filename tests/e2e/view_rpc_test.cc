#include <future>
#include <thread>

#include "core/base/limits.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using std::chrono::milliseconds;

class ViewRpcTest : public RpcTest {
 protected:
  static v1::QueryBatch seen(const std::function<void(v1::View*)>& set) {
    v1::QueryBatch batch;
    set(batch.mutable_view());
    return batch;
  }

  grpc::Status query_within(const v1::QueryBatch& batch, milliseconds timeout, v1::QueryResult* result = nullptr) {
    grpc::ClientContext context;
    set_timeout(context, timeout);
    v1::QueryRequest request;
    request.set_scene("world");
    *request.mutable_batch() = batch;
    v1::QueryResponse response;
    const grpc::Status status = stubs().queries->Query(&context, request, &response);
    if (result != nullptr) *result = response.result();
    return status;
  }

  // Starts a query on a thread of its own. The query waits for `revision`, which is not published yet.
  std::future<grpc::Status> waiting_query(uint64_t revision) {
    return std::async(std::launch::async, [this, revision] {
      return query_within(seen([revision](v1::View* view) { view->set_at_least(revision); }),
                          std::chrono::duration_cast<milliseconds>(kCallTimeout));
    });
  }
};

TEST_F(ViewRpcTest, AtLeastSeesTheCallersOwnWrites) {
  for (uint64_t id = 1; id <= 20; ++id) {
    v1::UpdateAck ack;
    ASSERT_TRUE(apply(insert_balls(id, id), &ack).ok());
    v1::QueryBatch batch = seen([&ack](v1::View* view) {
      view->set_at_least(ack.revision());
      view->set_epoch(ack.epoch());
    });
    batch.add_blocks()->mutable_lookup()->add_ids(id);
    v1::QueryResult result;
    ASSERT_TRUE(query(batch, &result).ok());
    EXPECT_EQ(result.blocks(0).ids(0), id);
    EXPECT_GE(result.revision(), ack.revision());
  }
}

TEST_F(ViewRpcTest, AtLeastWaitsUntilTheRevisionIsPublished) {
  std::future<grpc::Status> waiter = waiting_query(2);
  ASSERT_TRUE(apply(insert_balls(1, 1)).ok());
  ASSERT_TRUE(apply(insert_balls(2, 2)).ok());
  EXPECT_TRUE(waiter.get().ok());
}

TEST_F(ViewRpcTest, AtLeastEndsWithTheCallsDeadline) {
  const v1::QueryBatch batch = seen([](v1::View* view) { view->set_at_least(99); });
  EXPECT_EQ(query_within(batch, milliseconds(50)).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST_F(ViewRpcTest, AtLeastWithoutADeadlineEndsAfterASecondWithTheScenesRevision) {
  grpc::ClientContext context;
  v1::QueryRequest request;
  request.set_scene("world");
  *request.mutable_batch() = seen([](v1::View* view) { view->set_at_least(99); });
  v1::QueryResponse response;
  const grpc::Status status = stubs().queries->Query(&context, request, &response);
  expect_refused(status, {grpc::StatusCode::DEADLINE_EXCEEDED, v1::REASON_OUT_OF_RANGE, "view.at_least"});
}

TEST_F(ViewRpcTest, DeletingTheSceneWakesItsWaiters) {
  std::future<grpc::Status> waiter = waiting_query(99);
  ASSERT_TRUE(remove("world").ok());
  const grpc::Status status = waiter.get();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(error_of(status).reason(), v1::REASON_NOT_FOUND);
}

TEST_F(ViewRpcTest, ExactlyGivesTheSameAnswerWhileTheSceneChanges) {
  ASSERT_TRUE(apply(insert_balls(1, 3)).ok());
  v1::QueryBatch batch = ray_along_x();
  batch.mutable_view()->set_exactly(1);
  v1::QueryResult before;
  ASSERT_TRUE(query(batch, &before).ok());
  for (uint64_t id = 10; id < 20; ++id) ASSERT_TRUE(apply(insert_balls(id, id)).ok());
  v1::UpdateBatch removal;
  removal.set_clear(true);
  ASSERT_TRUE(apply(removal).ok());
  v1::QueryResult after;
  ASSERT_TRUE(query(batch, &after).ok());
  EXPECT_EQ(after.SerializeAsString(), before.SerializeAsString());
}

TEST_F(ViewRpcTest, RevisionsThatAreNotKeptAreOutOfRangeWithTheRange) {
  for (uint64_t id = 1; id <= limits::kRecentRevisions + 5; ++id) ASSERT_TRUE(apply(insert_balls(id, id)).ok());
  for (const uint64_t revision : {uint64_t{1}, uint64_t{1000}}) {
    const grpc::Status status = query(seen([revision](v1::View* view) { view->set_exactly(revision); }));
    expect_refused(status, {grpc::StatusCode::OUT_OF_RANGE, v1::REASON_OUT_OF_RANGE, "view.exactly"});
    EXPECT_THAT(status.error_message(), ::testing::HasSubstr("69"));
    EXPECT_EQ(error_of(status).limit(), "recent_revisions");
  }
}

TEST_F(ViewRpcTest, AViewOfTheOldEpochIsRefusedAfterTheSceneIsRecreated) {
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(insert_balls(1, 1), &ack).ok());
  const auto batch = [&ack](const std::function<void(v1::View*)>& set) {
    return seen([&](v1::View* view) {
      view->set_epoch(ack.epoch());
      set(view);
    });
  };
  const std::vector<v1::QueryBatch> batches = {batch([](v1::View*) {}),
                                               batch([&ack](v1::View* view) { view->set_at_least(ack.revision()); }),
                                               batch([&ack](v1::View* view) { view->set_exactly(ack.revision()); })};
  for (const v1::QueryBatch& same_epoch : batches) EXPECT_TRUE(query(same_epoch).ok());
  ASSERT_TRUE(remove("world").ok());
  ASSERT_TRUE(create("world").ok());
  for (const v1::QueryBatch& other_epoch : batches)
    expect_refused(query(other_epoch),
                   {grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_SCENE_RESTARTED, "view.epoch"});
}

TEST_F(ViewRpcTest, EveryReplyIsOfOneRevisionWhileAWriterRuns) {
  // Each batch moves both balls, so both balls are on the same side in every revision.
  ASSERT_TRUE(apply(insert_balls(1, 2)).ok());
  std::thread writer([this] {
    for (int i = 0; i < 200; ++i) {
      v1::UpdateBatch batch;
      v1::Move* move = batch.add_moves();
      fill(move->mutable_ids(), {uint64_t{1}, uint64_t{2}});
      const float side = i % 2 == 0 ? 1000.f : -1000.f;
      fill(move->mutable_positions(), {side, 0.f, 0.f, side, 50.f, 0.f});
      EXPECT_TRUE(apply(batch).ok());
    }
  });
  v1::QueryBatch batch;
  fill(batch.add_blocks()->mutable_lookup()->mutable_ids(), {uint64_t{1}});
  fill(batch.add_blocks()->mutable_lookup()->mutable_ids(), {uint64_t{2}});
  uint64_t last_revision = 0;
  for (int i = 0; i < 200; ++i) {
    v1::QueryResult result;
    ASSERT_TRUE(query(batch, &result).ok());
    if (result.revision() > 1) {
      EXPECT_EQ(result.blocks(0).positions(0), result.blocks(1).positions(0));
    }
    EXPECT_GE(result.revision(), last_revision);
    last_revision = result.revision();
  }
  writer.join();
}

}  // namespace
}  // namespace locus::test
