#include <functional>
#include <limits>

#include "core/base/limits.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;

const float kNan = std::numeric_limits<float>::quiet_NaN();
const float kInfinity = std::numeric_limits<float>::infinity();

class UpdateRpcTest : public RpcTest {
 protected:
  void SetUp() override {
    RpcTest::SetUp();
    ASSERT_TRUE(apply(insert_balls(1, 4)).ok());
  }

  // Expects the whole batch to be refused and the scene to be unchanged.
  void expect_batch_refused(const v1::UpdateBatch& batch, const Refused& expected) {
    const std::string before = dump();
    expect_refused(apply(batch), expected);
    EXPECT_EQ(dump(), before);
  }

  // Expects that the only item of the batch is refused and the scene is unchanged; and that the whole batch is refused
  // if all_or_nothing is set.
  void expect_item_refused(v1::UpdateBatch batch, const std::string& field, uint32_t index, uint64_t id,
                           v1::Reason reason) {
    const std::string before = dump();
    v1::UpdateAck ack;
    ASSERT_TRUE(apply(batch, &ack).ok());
    EXPECT_EQ(ack.refused(), 1u);
    ASSERT_EQ(ack.errors_size(), 1);
    EXPECT_EQ(ack.errors(0).field(), field);
    EXPECT_EQ(ack.errors(0).index(), index);
    EXPECT_EQ(ack.errors(0).id(), id);
    EXPECT_EQ(ack.errors(0).reason(), reason);
    EXPECT_EQ(dump(), before);
    batch.set_all_or_nothing(true);
    expect_batch_refused(batch, {grpc::StatusCode::INVALID_ARGUMENT, reason, field, index});
  }
};

TEST_F(UpdateRpcTest, ABatchIsOneRevisionWithAnAckThatCountsIt) {
  v1::UpdateBatch batch = insert_balls(10, 11);
  batch.set_tick(5);
  batch.add_remove_ids(1);
  v1::Move* move = batch.add_moves();
  move->add_ids(2);
  fill(move->mutable_positions(), {0.f, 50.f, 0.f});
  v1::Relabel* relabel = batch.add_relabels();
  relabel->add_ids(3);
  relabel->add_tags(77);
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(batch, &ack).ok());
  EXPECT_EQ(ack.applied(), 5u);
  EXPECT_EQ(ack.refused(), 0u);
  EXPECT_EQ(ack.revision(), 2u);
  EXPECT_EQ(ack.tick(), 5u);
  EXPECT_EQ(ack.epoch(), get("world").epoch());
  EXPECT_FALSE(ack.duplicate());
  v1::QueryBatch lookup;
  fill(lookup.add_blocks()->mutable_lookup()->mutable_ids(), {uint64_t{1}, uint64_t{2}, uint64_t{3}});
  for (const v1::Column column : {v1::COLUMN_ID, v1::COLUMN_POSE, v1::COLUMN_TAG})
    lookup.mutable_blocks(0)->add_columns(column);
  v1::QueryResult result;
  ASSERT_TRUE(query(lookup, &result).ok());
  EXPECT_THAT(result.blocks(0).ids(), ElementsAre(0u, 2u, 3u));
  EXPECT_EQ(result.blocks(0).positions(4), 50);
  EXPECT_EQ(result.blocks(0).tags(2), 77u);
}

TEST_F(UpdateRpcTest, AnEmptyBatchReportsTheRevisionAndMakesNone) {
  v1::UpdateAck ack;
  ASSERT_TRUE(apply({}, &ack).ok());
  EXPECT_EQ(ack.revision(), 1u);
  EXPECT_EQ(get("world").revision(), 1u);
}

TEST_F(UpdateRpcTest, TheTickNeverGoesDownUnlessItRestarts) {
  v1::UpdateBatch batch;
  v1::UpdateAck ack;
  batch.set_tick(10);
  ASSERT_TRUE(apply(batch, &ack).ok());
  batch.set_tick(5);
  ASSERT_TRUE(apply(batch, &ack).ok());
  EXPECT_EQ(ack.tick(), 10u);
  batch.set_restart_ticks(true);
  ASSERT_TRUE(apply(batch, &ack).ok());
  EXPECT_EQ(ack.tick(), 5u);
}

TEST_F(UpdateRpcTest, FramesAreAddedToRelativePositionsOnly) {
  v1::UpdateBatch batch;
  batch.mutable_frame()->set_x(1000);
  v1::Insert* relative = batch.add_inserts();
  relative->add_ids(50);
  fill(relative->mutable_positions(), {1.f, 0.f, 0.f});
  relative->mutable_point();
  v1::Insert* absolute = batch.add_inserts();
  absolute->add_ids(51);
  fill(absolute->mutable_positions_f64(), {1.0, 0.0, 0.0});
  absolute->mutable_point();
  ASSERT_TRUE(apply(batch).ok());
  v1::QueryBatch lookup;
  fill(lookup.add_blocks()->mutable_lookup()->mutable_ids(), {uint64_t{50}, uint64_t{51}});
  v1::QueryResult result;
  ASSERT_TRUE(query(lookup, &result).ok());
  EXPECT_EQ(result.blocks(0).positions(0), 1001);
  EXPECT_EQ(result.blocks(0).positions(3), 1);
}

TEST_F(UpdateRpcTest, WrongValuesOfAnInsertRefuseThatItemAndNameIt) {
  const auto refused = [this](const std::string& field, v1::Reason reason,
                              const std::function<void(v1::Insert*)>& spoil) {
    SCOPED_TRACE(field);
    v1::UpdateBatch batch;
    v1::Insert* insert = batch.add_inserts();
    insert->add_ids(50);
    fill(insert->mutable_positions(), {0.f, 0.f, 0.f});
    insert->mutable_ball()->add_radii(1);
    spoil(insert);
    expect_item_refused(batch, "inserts[0]." + field, 0, insert->ids(0), reason);
  };
  const auto position = [](float x) { return [x](v1::Insert* insert) { insert->set_positions(1, x); }; };
  refused("positions", v1::REASON_NOT_FINITE, position(kNan));
  refused("positions", v1::REASON_NOT_FINITE, position(kInfinity));
  refused("positions", v1::REASON_OUT_OF_RANGE, position(2e9f));
  const auto radius = [](float r) { return [r](v1::Insert* insert) { insert->mutable_ball()->set_radii(0, r); }; };
  refused("ball.radii", v1::REASON_OUT_OF_RANGE, radius(-1));
  refused("ball.radii", v1::REASON_NOT_FINITE, radius(kNan));
  refused("ball.radii", v1::REASON_OUT_OF_RANGE, radius(2e9f));
  const auto extent = [](float e) {
    return [e](v1::Insert* insert) { fill(insert->mutable_box()->mutable_half_extents(), {1.f, e, 1.f}); };
  };
  refused("box.half_extents", v1::REASON_OUT_OF_RANGE, extent(-1));
  refused("box.half_extents", v1::REASON_NOT_FINITE, extent(kInfinity));
  const auto axis = [](float a) {
    return [a](v1::Insert* insert) {
      insert->mutable_capsule()->add_radii(1);
      fill(insert->mutable_capsule()->mutable_half_axes(), {0.f, 0.f, a});
    };
  };
  refused("capsule.half_axes", v1::REASON_NOT_FINITE, axis(kNan));
  const auto rotation = [](float w) {
    return [w](v1::Insert* insert) { fill(insert->mutable_rotations(), {0.f, 0.f, 0.f, w}); };
  };
  refused("rotations", v1::REASON_OUT_OF_RANGE, rotation(0.9f));
  refused("rotations", v1::REASON_OUT_OF_RANGE, rotation(0));
  refused("rotations", v1::REASON_NOT_FINITE, rotation(kNan));
  refused("ids", v1::REASON_OUT_OF_RANGE, [](v1::Insert* insert) { insert->set_ids(0, 0); });
  refused("ids", v1::REASON_DUPLICATE_ID, [](v1::Insert* insert) { insert->set_ids(0, 1); });
}

TEST_F(UpdateRpcTest, UnknownIdsAndTheGroupZeroRefuseTheirItem) {
  v1::UpdateBatch batch;
  batch.add_remove_ids(99);
  expect_item_refused(batch, "remove_ids", 0, 99, v1::REASON_UNKNOWN_ID);
  batch.Clear();
  batch.add_remove_groups(0);
  expect_item_refused(batch, "remove_groups", 0, 0, v1::REASON_OUT_OF_RANGE);
  batch.Clear();
  v1::Move* move = batch.add_moves();
  move->add_ids(99);
  fill(move->mutable_positions(), {0.f, 0.f, 0.f});
  expect_item_refused(batch, "moves[0].ids", 0, 99, v1::REASON_UNKNOWN_ID);
  batch.Clear();
  v1::Relabel* relabel = batch.add_relabels();
  relabel->add_ids(99);
  relabel->add_tags(1);
  expect_item_refused(batch, "relabels[0].ids", 0, 99, v1::REASON_UNKNOWN_ID);
}

TEST_F(UpdateRpcTest, TheRestOfABatchIsAppliedAroundARefusedItem) {
  v1::UpdateBatch batch = insert_balls(4, 6);
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(batch, &ack).ok());
  EXPECT_EQ(ack.applied(), 2u);
  EXPECT_EQ(ack.refused(), 1u);
  EXPECT_EQ(ack.errors(0).id(), 4u);
  EXPECT_EQ(get("world").objects(), 6u);
}

TEST_F(UpdateRpcTest, UpsertReplacesObjectsButNotInstances) {
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  ASSERT_TRUE(change(place_one("cube", 100)).ok());
  v1::UpdateBatch batch = insert_balls(1, 1);
  batch.mutable_inserts(0)->mutable_point();
  batch.set_upsert(true);
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(batch, &ack).ok());
  EXPECT_EQ(ack.applied(), 1u);
  EXPECT_EQ(get("world").objects(), 4u);
  batch.mutable_inserts(0)->set_ids(0, 100);
  expect_item_refused(batch, "inserts[0].ids", 0, 100, v1::REASON_DUPLICATE_ID);
}

TEST_F(UpdateRpcTest, AtMostAThousandRefusedItemsAreListedAndAllAreCounted) {
  v1::UpdateBatch batch;
  for (uint64_t id = 1000; id < 3500; ++id) batch.add_remove_ids(id);
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(batch, &ack).ok());
  EXPECT_EQ(ack.refused(), 2500u);
  EXPECT_EQ(ack.errors_size(), static_cast<int>(limits::kMaxListedItemErrors));
  EXPECT_EQ(ack.errors(999).index(), 999u);
}

TEST_F(UpdateRpcTest, WrongFormRefusesTheBatch) {
  const auto refused = [this](const std::string& field, v1::Reason reason,
                              const std::function<void(v1::UpdateBatch*)>& spoil) {
    SCOPED_TRACE(field);
    v1::UpdateBatch batch = insert_balls(50, 52);
    v1::Move* move = batch.add_moves();
    move->add_ids(1);
    fill(move->mutable_positions(), {0.f, 0.f, 0.f});
    batch.add_relabels()->add_ids(1);
    spoil(&batch);
    expect_batch_refused(batch, {grpc::StatusCode::INVALID_ARGUMENT, reason, field});
  };
  const v1::Reason length = v1::REASON_COLUMN_LENGTH;
  refused("frame", v1::REASON_NOT_FINITE, [](auto* batch) { batch->mutable_frame()->set_y(kNan); });
  refused("frame", v1::REASON_OUT_OF_RANGE, [](auto* batch) { batch->mutable_frame()->set_y(2e9); });
  refused("inserts[0].shape", v1::REASON_MALFORMED, [](auto* batch) { batch->mutable_inserts(0)->clear_shape(); });
  refused("inserts[0].positions", length, [](auto* batch) { batch->mutable_inserts(0)->add_positions(1); });
  refused("inserts[0].positions", v1::REASON_MALFORMED,
          [](auto* batch) { batch->mutable_inserts(0)->clear_positions(); });
  refused("inserts[0].positions_f64", v1::REASON_MALFORMED, [](auto* batch) {
    fill(batch->mutable_inserts(0)->mutable_positions_f64(), {0., 0., 0.});
  });
  refused("inserts[0].rotations", length, [](auto* batch) { batch->mutable_inserts(0)->add_rotations(1); });
  refused("inserts[0].ball.radii", length,
          [](auto* batch) { batch->mutable_inserts(0)->mutable_ball()->add_radii(1); });
  refused("inserts[0].ball.radii", length,
          [](auto* batch) { batch->mutable_inserts(0)->mutable_ball()->clear_radii(); });
  refused("inserts[0].box.half_extents", length, [](auto* batch) { batch->mutable_inserts(0)->mutable_box(); });
  refused("inserts[0].capsule.half_axes", length,
          [](auto* batch) { batch->mutable_inserts(0)->mutable_capsule()->add_radii(1); });
  refused("inserts[0].layers", length, [](auto* batch) {
    fill(batch->mutable_inserts(0)->mutable_layers(), {1u, 2u});
  });
  refused("moves[0].positions", v1::REASON_MALFORMED, [](auto* batch) { batch->mutable_moves(0)->clear_positions(); });
  refused("moves[0].rotations", length, [](auto* batch) { batch->mutable_moves(0)->add_rotations(1); });
  refused("relabels[0].tags", length, [](auto* batch) {
    fill(batch->mutable_relabels(0)->mutable_tags(), {uint64_t{1}, uint64_t{2}});
  });
  refused("writer", v1::REASON_MALFORMED, [](auto* batch) { batch->set_batch(1); });
  refused("batch", v1::REASON_MALFORMED, [](auto* batch) { batch->set_writer(1); });
}

TEST_F(UpdateRpcTest, MoreItemsOrListsThanABatchMayHaveAreRefusedNamingTheLimit) {
  const std::string before = dump();
  v1::UpdateBatch batch;
  batch.mutable_remove_ids()->Resize(static_cast<int>(limits::kMaxUpdateItems) + 1, 1);
  v1::Error error = error_of(apply(batch));
  EXPECT_EQ(error.code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(error.limit(), "update_items");
  EXPECT_EQ(error.limit_value(), limits::kMaxUpdateItems);
  EXPECT_EQ(error.asked(), limits::kMaxUpdateItems + 1.0);
  batch.Clear();
  for (uint32_t i = 0; i <= limits::kMaxUpdateLists; ++i) batch.add_relabels();
  error = error_of(apply(batch));
  EXPECT_EQ(error.code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(error.limit(), "update_lists");
  EXPECT_EQ(dump(), before);
}

TEST_F(UpdateRpcTest, AWritersBatchIsAppliedOnceAndInOrder) {
  v1::UpdateBatch batch = insert_balls(10, 10);
  batch.set_writer(0xABCDEF);
  batch.set_batch(1);
  v1::UpdateAck first;
  ASSERT_TRUE(apply(batch, &first).ok());
  EXPECT_FALSE(first.duplicate());
  v1::UpdateAck again;
  ASSERT_TRUE(apply(batch, &again).ok());
  EXPECT_TRUE(again.duplicate());
  EXPECT_EQ(again.revision(), first.revision());
  EXPECT_EQ(again.applied(), first.applied());
  EXPECT_EQ(get("world").revision(), first.revision());
  batch = insert_balls(11, 11);
  batch.set_writer(0xABCDEF);
  batch.set_batch(3);
  const std::string before = dump();
  const v1::Error error = error_of(apply(batch));
  expect_error(error, {grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_BATCH_GAP, "batch"});
  EXPECT_EQ(error.limit_value(), 2);
  EXPECT_EQ(error.asked(), 3);
  EXPECT_EQ(dump(), before);
}

TEST_F(UpdateRpcTest, ARefusedBatchDoesNotUseUpItsNumber) {
  v1::UpdateBatch batch = insert_balls(1, 1);
  batch.set_writer(5);
  batch.set_batch(1);
  batch.set_all_or_nothing(true);
  EXPECT_FALSE(apply(batch).ok());
  batch.mutable_inserts(0)->set_ids(0, 10);
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(batch, &ack).ok());
  EXPECT_FALSE(ack.duplicate());
  EXPECT_EQ(ack.applied(), 1u);
}

}  // namespace
}  // namespace locus::test
