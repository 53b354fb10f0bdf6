// Queries by list (QueryBatch.by_list): the bytes of the answers are those of queries by the structures.
#include "tests/support/row_of_balls.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using ByListRpcTest = RowOfBallsTest;

v1::QueryBlock ball_at(float x, float radius) {
  v1::QueryBlock block;
  fill(block.mutable_balls()->mutable_centers(), {x, 0.f, 0.f});
  block.mutable_balls()->add_radii(radius);
  return block;
}

// Returns a batch with a block of several kinds.
v1::QueryBatch several_kinds() {
  v1::QueryBatch batch = ray_along_x();
  *batch.add_blocks() = ball_at(9, 2.5f);
  v1::Boxes* boxes = batch.add_blocks()->mutable_boxes();
  fill(boxes->mutable_centers(), {6.f, 0.f, 0.f});
  fill(boxes->mutable_half_extents(), {4.f, 4.f, 4.f});
  fill(batch.add_blocks()->mutable_nearest()->mutable_points(), {5.f, 1.f, 1.f});
  v1::Lookup* lookup = batch.add_blocks()->mutable_lookup();
  for (const uint64_t id : {2u, 100u, 77u}) lookup->add_ids(id);
  batch.add_blocks()->mutable_pairs()->set_max_distance(1);
  return batch;
}

TEST_F(ByListRpcTest, AnswersByListHaveTheSameBytesAndTestEveryValue) {
  ASSERT_TRUE(apply(insert_balls(1000, 1299)).ok());
  v1::QueryBatch batch = several_kinds();
  const std::string searched = ask(batch).SerializeAsString();
  batch.set_by_list(true);
  EXPECT_EQ(ask(batch).SerializeAsString(), searched);
  batch.set_explain(true);
  const v1::QueryResult explained = ask(batch);
  EXPECT_GE(explained.blocks(1).work().tests(), 305u) << "of a ball: all objects and the instance";
  EXPECT_EQ(explained.blocks(1).work().nodes(), 0u);
  EXPECT_EQ(explained.blocks(1).work().cells(), 0u);
}

TEST_F(ByListRpcTest, StreamsAndStepsAnswerByListToo) {
  v1::QueryBatch batch = several_kinds();
  const v1::QueryResult searched = ask(batch);
  batch.set_by_list(true);
  batch.set_explain(true);
  const auto expect_listed = [&](v1::QueryResult listed) {
    ASSERT_EQ(listed.blocks_size(), searched.blocks_size());
    EXPECT_EQ(listed.blocks(1).work().cells(), 0u) << "no structure was searched";
    for (v1::BlockResult& block : *listed.mutable_blocks()) block.clear_work();
    listed.clear_work();
    EXPECT_EQ(listed.SerializeAsString(), searched.SerializeAsString());
  };
  v1::StepRequest step;
  step.set_scene("world");
  *step.mutable_queries() = batch;
  v1::StepResponse stepped;
  ASSERT_TRUE(call(*stubs().queries, &v1::QueryService::Stub::Step, step, &stepped).ok());
  expect_listed(stepped.result());
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().queries->StreamQueries(&context);
  v1::StreamQueriesRequest message;
  message.set_scene("world");
  *message.mutable_batch() = batch;
  ASSERT_TRUE(stream->Write(message));
  v1::StreamQueriesResponse answered;
  ASSERT_TRUE(stream->Read(&answered));
  expect_listed(answered.result());
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(ByListRpcTest, AWorkBudgetTruncatesAnswersByListToo) {
  ASSERT_TRUE(apply(insert_balls(1000, 3000)).ok());
  v1::QueryBatch batch;
  for (int i = 0; i < 100; ++i) *batch.add_blocks() = ball_at(-1000, 0.5f);
  EXPECT_THAT(ask(batch).blocks(99).truncated(), IsEmpty());
  batch.set_by_list(true);
  batch.set_max_work(1);
  EXPECT_THAT(ask(batch).blocks(99).truncated(), ElementsAre(0u));
}

}  // namespace
}  // namespace locus::test
