// History over gRPC: scenes with history, queries about past ticks, and refusals of ticks that are not kept.
#include <limits>

#include "core/base/limits.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

v1::SceneSpec history(uint32_t ticks, uint64_t bytes = 0) {
  v1::SceneSpec spec;
  spec.set_history_ticks(ticks);
  spec.set_history_bytes(bytes);
  return spec;
}

// Scene at tick 30 that keeps a history of ten ticks. At each tick, ball 1 is at x = 3 + 10 * tick.
class RewindRpcTest : public RpcTest {
 protected:
  void SetUp() override {
    ASSERT_TRUE(create("world", history(10)).ok());
    ASSERT_TRUE(apply(insert_balls(1, 1)).ok());
    for (uint64_t tick = 1; tick <= 30; ++tick) {
      v1::UpdateBatch batch;
      batch.set_tick(tick);
      v1::Move* move = batch.add_moves();
      move->add_ids(1);
      fill(move->mutable_positions(), {3 + 10 * static_cast<float>(tick), 0.f, 0.f});
      ASSERT_TRUE(apply(batch).ok());
    }
  }

  static v1::QueryBatch where_at(std::initializer_list<uint64_t> ticks, std::initializer_list<float> fractions = {}) {
    v1::QueryBatch batch;
    v1::QueryBlock* block = batch.add_blocks();
    for (size_t i = 0; i < ticks.size(); ++i) block->mutable_lookup()->add_ids(1);
    fill(block->mutable_as_of_ticks(), ticks);
    fill(block->mutable_as_of_fractions(), fractions);
    return batch;
  }
  v1::BlockResult answer(const v1::QueryBatch& batch) {
    v1::QueryResult result;
    const grpc::Status status = query(batch, &result);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return result.blocks_size() == 1 ? result.blocks(0) : v1::BlockResult();
  }
};

TEST_F(RewindRpcTest, EachQueryIsAnsweredAtItsOwnTime) {
  const v1::BlockResult result = answer(where_at({20, 25, 30}, {0, 0.5f, 0}));
  EXPECT_THAT(result.positions(), ElementsAre(203, 0, 0, 258, 0, 0, 303, 0, 0));
  EXPECT_THAT(result.resolved_ticks(), ElementsAre(20, 25, 30));
  EXPECT_THAT(result.resolved_fractions(), ElementsAre(0, 0.5f, 0));
  EXPECT_THAT(result.clamped(), IsEmpty());
}

TEST_F(RewindRpcTest, QueriesWithoutATimeReturnNoTimes) {
  const v1::BlockResult result = answer(ray_along_x());
  EXPECT_THAT(result.ids(), ElementsAre(1));
  EXPECT_THAT(result.resolved_ticks(), IsEmpty());
  EXPECT_THAT(result.resolved_fractions(), IsEmpty());
}

TEST_F(RewindRpcTest, RaysAndBallsFindObjectsAtTheirPastPositions) {
  v1::QueryBatch batch = ray_along_x();
  batch.mutable_blocks(0)->add_as_of_ticks(22);
  EXPECT_THAT(answer(batch).t(), ElementsAre(222));
  v1::QueryBatch balls;
  v1::QueryBlock* block = balls.add_blocks();
  fill(block->mutable_balls()->mutable_centers(), {223.f, 0.f, 0.f, 303.f, 0.f, 0.f});
  block->mutable_balls()->add_radii(1);
  block->add_as_of_ticks(22);
  EXPECT_THAT(answer(balls).counts(), ElementsAre(1, 0));
}

TEST_F(RewindRpcTest, TimesOutsideHistoryAreRefusedWithItsRange) {
  const grpc::Status too_old = query(where_at({25, 19}, {0, 0.5f}));
  expect_refused(too_old, {grpc::StatusCode::OUT_OF_RANGE, v1::REASON_OUT_OF_RANGE, "blocks[0].as_of_ticks", 1});
  EXPECT_THAT(too_old.error_message(), HasSubstr("ticks are 20 to 30"));
  expect_refused(query(where_at({31})),
                 {grpc::StatusCode::OUT_OF_RANGE, v1::REASON_OUT_OF_RANGE, "blocks[0].as_of_ticks", 0});
}

TEST_F(RewindRpcTest, ClampingUsesTheNearestTimeAndFlagsIt) {
  v1::QueryBatch batch = where_at({3, 25, 99}, {0.5f});
  batch.mutable_blocks(0)->set_outside_history(v1::OUTSIDE_HISTORY_CLAMP);
  const v1::BlockResult result = answer(batch);
  EXPECT_THAT(result.resolved_ticks(), ElementsAre(20, 25, 30));
  EXPECT_THAT(result.resolved_fractions(), ElementsAre(0, 0.5f, 0));
  EXPECT_THAT(result.clamped(), ElementsAre(0, 2));
}

TEST_F(RewindRpcTest, WrongColumnsAreNamed) {
  const auto refused = [this](const v1::QueryBatch& batch, v1::Reason reason, const std::string& field,
                              std::optional<uint32_t> index = {}) {
    expect_refused(query(batch), {grpc::StatusCode::INVALID_ARGUMENT, reason, "blocks[0]." + field, index});
  };
  refused(where_at({25, 26}, {0, 1}), v1::REASON_OUT_OF_RANGE, "as_of_fractions", 1);
  refused(where_at({25, 26}, {0, -0.5f}), v1::REASON_OUT_OF_RANGE, "as_of_fractions", 1);
  refused(where_at({25}, {std::numeric_limits<float>::quiet_NaN()}), v1::REASON_NOT_FINITE, "as_of_fractions", 0);
  refused(where_at({25, 26, 27}, {0, 0}), v1::REASON_COLUMN_LENGTH, "as_of_fractions");
  v1::QueryBatch batch = ray_along_x();
  batch.mutable_blocks(0)->add_as_of_fractions(0);
  refused(batch, v1::REASON_MALFORMED, "as_of_fractions");
  fill(batch.mutable_blocks(0)->mutable_as_of_ticks(), {uint64_t{25}, uint64_t{26}});
  refused(batch, v1::REASON_COLUMN_LENGTH, "as_of_ticks");
  batch = where_at({25});
  batch.mutable_blocks(0)->set_outside_history(static_cast<v1::OutsideHistory>(7));
  refused(batch, v1::REASON_MALFORMED, "outside_history");
}

TEST_F(RewindRpcTest, ASceneReportsItsHistory) {
  const v1::Scene scene = get("world");
  EXPECT_EQ(scene.tick(), 30u);
  EXPECT_EQ(scene.oldest_tick(), 20u);
  EXPECT_EQ(scene.recorded_ticks(), 10u);
  EXPECT_GT(scene.history_bytes(), 0u);
  EXPECT_EQ(scene.history_limit(), v1::HISTORY_LIMIT_TICKS);
  EXPECT_EQ(scene.forgotten_ticks(), 0u);
  EXPECT_EQ(scene.spec().history_ticks(), 10u);
  EXPECT_EQ(scene.spec().history_bytes(), limits::kDefaultHistoryBytes);
}

TEST_F(RewindRpcTest, RestartingTicksDropsHistory) {
  v1::UpdateBatch batch;
  batch.set_restart_ticks(true);
  batch.set_tick(1);
  ASSERT_TRUE(apply(batch).ok());
  EXPECT_EQ(get("world").oldest_tick(), 1u);
  EXPECT_EQ(get("world").recorded_ticks(), 0u);
}

TEST_F(RewindRpcTest, ASceneWithoutHistoryAnswersOnlyTheCurrentTick) {
  ASSERT_TRUE(create("brief").ok());
  v1::UpdateBatch batch = insert_balls(1, 1);
  batch.set_tick(5);
  ASSERT_TRUE(apply(batch, nullptr, "brief").ok());
  EXPECT_TRUE(query(where_at({5}), nullptr, "brief").ok());
  EXPECT_EQ(query(where_at({4}), nullptr, "brief").error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(get("brief").oldest_tick(), 5u);
  EXPECT_EQ(get("brief").spec().history_bytes(), 0u);
}

TEST_F(RewindRpcTest, MoreHistoryThanASceneMayHaveIsRefused) {
  expect_refused(create("large", history(limits::kMaxHistoryTicks + 1)),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "spec.history_ticks"});
  expect_refused(create("large", history(1, limits::kMaxHistoryBytes + 1)),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "spec.history_bytes"});
  expect_refused(create("large", history(0, 1)),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "spec.history_bytes"});
}

}  // namespace
}  // namespace locus::test
