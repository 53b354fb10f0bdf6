// Compounds over the wire: rows that name parts, masks that select parts, the past, new poses of parts, refusals of
// each field, dumps, and a restart.
#include <gmock/gmock.h>

#include <functional>

#include "tests/support/kept_daemon.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr uint32_t kBodyLayer = 2, kHeadLayer = 4;

// Returns a rig at the origin, upright along z: part 0 is the body, a capsule from z = 0.5 to 1.5, part 1 the head, a
// ball at z = 2, and part 2 the pelvis, a box at z = 0.
v1::UpdateBatch insert_rig(uint64_t id) {
  v1::UpdateBatch batch;
  v1::Insert* insert = batch.add_inserts();
  insert->add_ids(id);
  fill(insert->mutable_positions(), {0.f, 0.f, 0.f});
  v1::Parts* body = insert->mutable_compound()->add_parts();
  fill(body->mutable_positions(), {0.f, 0.f, 1.f});
  body->mutable_capsule()->add_radii(0.3f);
  fill(body->mutable_capsule()->mutable_half_axes(), {0.f, 0.f, 0.5f});
  body->add_layers(kBodyLayer);
  v1::Parts* head = insert->mutable_compound()->add_parts();
  fill(head->mutable_positions(), {0.f, 0.f, 2.f});
  head->mutable_ball()->add_radii(0.2f);
  head->add_layers(kHeadLayer);
  v1::Parts* pelvis = insert->mutable_compound()->add_parts();
  fill(pelvis->mutable_positions(), {0.f, 0.f, 0.f});
  fill(pelvis->mutable_box()->mutable_half_extents(), {0.4f, 0.4f, 0.1f});
  pelvis->add_layers(kBodyLayer);
  return batch;
}

// Returns a batch with one ray along +x from x = -10 at height z.
v1::QueryBatch ray_at(float z, v1::RayMode mode = v1::RAY_MODE_FIRST) {
  v1::QueryBatch batch;
  v1::Rays* rays = batch.add_blocks()->mutable_rays();
  fill(rays->mutable_origins(), {-10.f, 0.f, z});
  fill(rays->mutable_directions(), {1.f, 0.f, 0.f});
  rays->set_mode(mode);
  return batch;
}

class CompoundRpcTest : public RpcTest {
 protected:
  void SetUp() override {
    v1::SceneSpec spec;
    spec.set_history_ticks(20);
    ASSERT_TRUE(create("world", spec).ok());
    const grpc::Status status = apply(insert_rig(7));
    ASSERT_TRUE(status.ok()) << status.error_message();
  }

  v1::BlockResult ask(const v1::QueryBatch& batch) {
    v1::QueryResult result;
    const grpc::Status status = query(batch, &result);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return result.blocks_size() == 1 ? result.blocks(0) : v1::BlockResult();
  }
  // Expects that a change of the rig's insertion refuses the whole batch.
  void expect_refusal(const std::string& field, v1::Reason reason, const std::function<void(v1::Insert*)>& spoil) {
    SCOPED_TRACE(field);
    v1::UpdateBatch batch = insert_rig(8);
    spoil(batch.mutable_inserts(0));
    expect_refused(apply(batch), {grpc::StatusCode::INVALID_ARGUMENT, reason, field});
  }
};

TEST_F(CompoundRpcTest, TheServerListsTheFeatureAndTheLimit) {
  v1::GetServerResponse response;
  ASSERT_TRUE(call(*stubs().server, &v1::ServerService::Stub::GetServer, v1::GetServerRequest(), &response).ok());
  EXPECT_THAT(response.features(), testing::Contains("compounds"));
  EXPECT_THAT(response.limits(), testing::Contains(testing::Property(&v1::Limit::name, "parts")));
}

TEST_F(CompoundRpcTest, RowsNameTheObjectAndThePart) {
  const v1::BlockResult head = ask(ray_at(2)), body = ask(ray_at(1));
  EXPECT_THAT(head.ids(), ElementsAre(7u));
  EXPECT_THAT(head.triangles(), ElementsAre(1u));
  EXPECT_NEAR(head.t(0), 9.8, 1e-5);
  EXPECT_THAT(body.triangles(), ElementsAre(0u));
  v1::QueryBatch down;
  v1::Rays* rays = down.add_blocks()->mutable_rays();
  fill(rays->mutable_origins(), {0.f, 0.f, 10.f});
  fill(rays->mutable_directions(), {0.f, 0.f, -1.f});
  rays->set_mode(v1::RAY_MODE_ALL);
  EXPECT_THAT(ask(down).triangles(), ElementsAre(1u, 0u, 2u));
}

TEST_F(CompoundRpcTest, MasksSelectParts) {
  v1::QueryBatch at_body = ray_at(1), at_head = ray_at(2);
  at_body.mutable_blocks(0)->add_masks(kHeadLayer);
  at_head.mutable_blocks(0)->add_masks(kHeadLayer);
  for (const v1::Column column : {v1::COLUMN_ID, v1::COLUMN_TRIANGLE, v1::COLUMN_LAYERS})
    at_head.mutable_blocks(0)->add_columns(column);
  EXPECT_THAT(ask(at_body).ids(), ElementsAre(0u));
  const v1::BlockResult head = ask(at_head);
  EXPECT_THAT(head.triangles(), ElementsAre(1u));
  EXPECT_THAT(head.layers(), ElementsAre(kHeadLayer));
}

TEST_F(CompoundRpcTest, BallsAndNearestReturnTheNearestPartOrAllParts) {
  v1::QueryBatch batch;
  v1::Balls* balls = batch.add_blocks()->mutable_balls();
  fill(balls->mutable_centers(), {0.f, 0.f, 2.f});
  balls->add_radii(3);
  for (const v1::Column column : {v1::COLUMN_ID, v1::COLUMN_TRIANGLE}) batch.mutable_blocks(0)->add_columns(column);
  EXPECT_THAT(ask(batch).triangles(), ElementsAre(1u));
  balls->set_detail(v1::STATIC_DETAIL_TRIANGLES);
  EXPECT_THAT(ask(batch).triangles(), ElementsAre(0u, 1u, 2u));
  v1::QueryBatch nearest;
  v1::Nearest* points = nearest.add_blocks()->mutable_nearest();
  fill(points->mutable_points(), {0.f, 0.f, -5.f});
  points->set_k(5);
  EXPECT_THAT(ask(nearest).triangles(), ElementsAre(2u));
  points->set_detail(v1::STATIC_DETAIL_TRIANGLES);
  EXPECT_THAT(ask(nearest).triangles(), ElementsAre(2u, 0u, 1u));
}

TEST_F(CompoundRpcTest, LookupsDescribeTheWholeCompound) {
  v1::QueryBatch lookup;
  lookup.add_blocks()->mutable_lookup()->add_ids(7);
  for (const v1::Column column : {v1::COLUMN_ID, v1::COLUMN_SHAPE, v1::COLUMN_LAYERS})
    lookup.mutable_blocks(0)->add_columns(column);
  const v1::BlockResult result = ask(lookup);
  EXPECT_THAT(result.shapes(), ElementsAre(6u));
  EXPECT_NEAR(result.sizes(0), 2.2, 1e-5);
  EXPECT_EQ(result.sizes(1), 3);
  EXPECT_THAT(result.layers(), ElementsAre(kBodyLayer | kHeadLayer));
}

TEST_F(CompoundRpcTest, OnePoseMovesAllPartsAndThePastKeepsThem) {
  v1::UpdateBatch move;
  move.set_tick(10);
  v1::Move* moves = move.add_moves();
  moves->add_ids(7);
  fill(moves->mutable_positions(), {0.f, 0.f, 5.f});
  fill(moves->mutable_rotations(), {1.f, 0.f, 0.f, 0.f});  // upside down
  ASSERT_TRUE(apply(move).ok());
  EXPECT_THAT(ask(ray_at(3)).triangles(), ElementsAre(1u));
  EXPECT_THAT(ask(ray_at(2)).ids(), ElementsAre(0u));
  v1::QueryBatch past = ray_at(2);
  past.mutable_blocks(0)->add_as_of_ticks(0);
  EXPECT_THAT(ask(past).triangles(), ElementsAre(1u));
}

TEST_F(CompoundRpcTest, MovesGivePartsNewPoses) {
  v1::UpdateBatch nod;
  v1::Move* move = nod.add_moves();
  move->add_ids(7);
  fill(move->mutable_positions(), {0.f, 0.f, 0.f});
  move->set_parts_each(3);
  fill(move->mutable_part_positions(), {0.f, 0.f, 1.f, 0.f, 0.f, 4.f, 0.f, 0.f, 0.f});
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(nod, &ack).ok());
  EXPECT_EQ(ack.applied(), 1u);
  EXPECT_THAT(ask(ray_at(4)).triangles(), ElementsAre(1u));
  EXPECT_THAT(ask(ray_at(2)).ids(), ElementsAre(0u));
  move->set_parts_each(2);
  fill(move->mutable_part_positions(), {0.f, 0.f, 1.f, 0.f, 0.f, 4.f});
  ASSERT_TRUE(apply(nod, &ack).ok());
  ASSERT_EQ(ack.errors_size(), 1);
  EXPECT_EQ(ack.errors(0).field(), "moves[0].parts_each");
  EXPECT_EQ(ack.errors(0).reason(), v1::REASON_OUT_OF_RANGE);
}

TEST_F(CompoundRpcTest, WrongFormsOfEachFieldAreRefused) {
  const auto parts = [](v1::Insert* insert, int i = 1) { return insert->mutable_compound()->mutable_parts(i); };
  expect_refusal("inserts[0].compound.parts", v1::REASON_MALFORMED,
                 [](v1::Insert* insert) { insert->mutable_compound()->clear_parts(); });
  expect_refusal("inserts[0].compound.parts[1].positions", v1::REASON_COLUMN_LENGTH,
                 [&](v1::Insert* insert) { parts(insert)->add_positions(1); });
  expect_refusal("inserts[0].compound.parts[1].rotations", v1::REASON_COLUMN_LENGTH,
                 [&](v1::Insert* insert) { parts(insert)->add_rotations(1); });
  expect_refusal("inserts[0].compound.parts[1].layers", v1::REASON_COLUMN_LENGTH,
                 [&](v1::Insert* insert) { parts(insert)->add_layers(1); });
  expect_refusal("inserts[0].compound.parts[1].ball.radii", v1::REASON_COLUMN_LENGTH,
                 [&](v1::Insert* insert) { parts(insert)->mutable_ball()->add_radii(1); });
  expect_refusal("inserts[0].compound.parts[2].box.half_extents", v1::REASON_COLUMN_LENGTH,
                 [&](v1::Insert* insert) { parts(insert, 2)->mutable_box()->clear_half_extents(); });
  expect_refusal("inserts[0].compound.parts[0].capsule.half_axes", v1::REASON_COLUMN_LENGTH,
                 [&](v1::Insert* insert) { parts(insert, 0)->mutable_capsule()->clear_half_axes(); });
  expect_refusal("inserts[0].compound.parts[1].shape", v1::REASON_MALFORMED,
                 [&](v1::Insert* insert) { parts(insert)->clear_shape(); });
  expect_refusal("inserts[0].compound.parts", v1::REASON_LIMIT, [&](v1::Insert* insert) {
    for (int i = 0; i < 3 * 64; ++i) parts(insert)->add_positions(1);
  });
  expect_refusal("inserts[0].compound.parts", v1::REASON_LIMIT, [&](v1::Insert* insert) {
    for (int i = 0; i < 64; ++i) *insert->mutable_compound()->add_parts() = insert->compound().parts(0);
  });
}

TEST_F(CompoundRpcTest, WrongValuesOfAPartRefuseEachItem) {
  v1::UpdateBatch batch = insert_rig(8);
  batch.mutable_inserts(0)->add_ids(9);
  batch.mutable_inserts(0)->mutable_compound()->mutable_parts(1)->mutable_ball()->set_radii(0, -1);
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(batch, &ack).ok());
  EXPECT_EQ(ack.refused(), 2u);
  ASSERT_EQ(ack.errors_size(), 2);
  EXPECT_EQ(ack.errors(1).field(), "inserts[0].compound.parts[1].ball.radii");
  EXPECT_EQ(ack.errors(1).index(), 1u);
  EXPECT_EQ(ack.errors(1).id(), 9u);
}

TEST_F(CompoundRpcTest, ADumpInsertsTheSameSceneAgain) {
  v1::UpdateBatch other = insert_rig(8);
  other.mutable_inserts(0)->add_ids(9);
  ASSERT_TRUE(apply(other).ok());
  std::vector<v1::DumpSceneResponse> pieces;
  ASSERT_TRUE(dump("world", &pieces).ok());
  ASSERT_TRUE(create("copy").ok());
  v1::UpdateBatch copy;
  for (const v1::DumpSceneResponse& piece : pieces)
    for (const v1::Insert& insert : piece.objects()) *copy.add_inserts() = insert;
  EXPECT_EQ(copy.inserts_size(), 2);  // compounds that share their parts share an insert
  ASSERT_TRUE(apply(copy, nullptr, "copy").ok());
  std::vector<v1::DumpSceneResponse> copied;
  ASSERT_TRUE(dump("copy", &copied).ok());
  ASSERT_EQ(copied.size(), pieces.size());
  for (size_t i = 0; i < pieces.size(); ++i) {
    for (v1::DumpSceneResponse* piece : {&pieces[i], &copied[i]}) {
      piece->clear_epoch();
      piece->clear_revision();
    }
    EXPECT_EQ(copied[i].DebugString(), pieces[i].DebugString());
  }
}

// Applies the records of a log and, after a second restart, reads a snapshot of the scene.
TEST(CompoundRestartTest, CompoundsAndTheirPosesSurviveRestarts) {
  KeptDaemon daemon({"--snapshot-after", "65536"});
  daemon.start();
  const auto call = [&](auto& stub, auto method, const auto& request, auto* response) {
    grpc::ClientContext context;
    set_timeout(context);
    const grpc::Status status = (stub.*method)(&context, request, response);
    EXPECT_TRUE(status.ok()) << status.error_message();
  };
  v1::CreateSceneRequest create;
  create.set_name("world");
  v1::CreateSceneResponse created;
  call(*daemon.stubs().scenes, &v1::SceneService::Stub::CreateScene, create, &created);
  const auto apply = [&](const v1::UpdateBatch& batch) {
    v1::ApplyUpdatesRequest request;
    request.set_scene("world");
    *request.mutable_batch() = batch;
    v1::ApplyUpdatesResponse response;
    call(*daemon.stubs().updates, &v1::UpdateService::Stub::ApplyUpdates, request, &response);
    EXPECT_EQ(response.ack().refused(), 0u) << response.DebugString();
  };
  const auto part_at = [&](float z) {
    v1::QueryRequest request;
    request.set_scene("world");
    *request.mutable_batch() = ray_at(z);
    v1::QueryResponse response;
    call(*daemon.stubs().queries, &v1::QueryService::Stub::Query, request, &response);
    return response.result().blocks(0).triangles(0);
  };
  apply(insert_rig(7));
  v1::UpdateBatch nod;
  v1::Move* move = nod.add_moves();
  move->add_ids(7);
  fill(move->mutable_positions(), {0.f, 0.f, 0.f});
  move->set_parts_each(3);
  fill(move->mutable_part_positions(), {0.f, 0.f, 1.f, 0.f, 0.f, 4.f, 0.f, 0.f, 0.f});
  apply(nod);
  EXPECT_EQ(part_at(4), 1u);
  daemon.kill();
  daemon.start();
  EXPECT_EQ(part_at(4), 1u);
  EXPECT_EQ(part_at(1), 0u);
  // Enough records for a snapshot.
  for (int i = 0; i < 2000 && daemon.log().find("snapshot written") == std::string::npos; ++i) {
    fill(move->mutable_part_positions(), {0.f, 0.f, 1.f, 0.f, 0.f, 4.f + static_cast<float>(i % 2), 0.f, 0.f, 0.f});
    apply(nod);
  }
  EXPECT_NE(daemon.log().find("snapshot written"), std::string::npos);
  fill(move->mutable_part_positions(), {0.f, 0.f, 1.f, 0.f, 0.f, 6.f, 0.f, 0.f, 0.f});
  apply(nod);
  EXPECT_EQ(daemon.stop(), 0);
  daemon.start();
  EXPECT_EQ(part_at(6), 1u);
  EXPECT_EQ(part_at(1), 0u);
}

}  // namespace
}  // namespace locus::test
