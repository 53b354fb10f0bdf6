#include "tests/support/random.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

constexpr size_t kMaxPiece = 4'000'000;

class DumpRpcTest : public RpcTest {
 protected:
  std::vector<v1::DumpSceneResponse> pieces_of(const std::string& scene, const v1::View& view = {}) {
    std::vector<v1::DumpSceneResponse> pieces;
    const grpc::Status status = dump(scene, &pieces, view);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return pieces;
  }

  // Joins the pieces of a dump into one list of objects and one of instances.
  static std::pair<v1::UpdateBatch, v1::ChangeInstancesRequest> joined(
      const std::vector<v1::DumpSceneResponse>& pieces) {
    std::pair<v1::UpdateBatch, v1::ChangeInstancesRequest> all;
    for (const v1::DumpSceneResponse& piece : pieces) {
      all.first.mutable_inserts()->MergeFrom(piece.objects());
      all.second.mutable_place()->MergeFrom(piece.instances());
    }
    return all;
  }
};

// Returns a batch that inserts `count` objects; each id gets a randomly chosen shape.
v1::UpdateBatch mixed_objects(Random& random, uint64_t count) {
  v1::UpdateBatch batch;
  for (int kind = 0; kind < 4; ++kind) batch.add_inserts();
  batch.mutable_inserts(0)->mutable_point();
  for (uint64_t id = 1; id <= count; ++id) {
    const int kind = random.whole(0, 3);
    v1::Insert* insert = batch.mutable_inserts(kind);
    insert->add_ids(id);
    const Vec3d position = random.vector(1e6);
    for (int axis = 0; axis < 3; ++axis) insert->add_positions_f64(position[axis]);
    const Quaternion q = random.rotation();
    for (const float part : {q.x, q.y, q.z, q.w}) insert->add_rotations(part);
    insert->add_layers(static_cast<uint32_t>(random.next()));
    insert->add_groups(random.below(3));
    insert->add_tags(random.next());
    const Vec3d size = random.positive_vector(3);
    if (kind == 1) insert->mutable_ball()->add_radii(static_cast<float>(size.x));
    if (kind == 3) insert->mutable_capsule()->add_radii(static_cast<float>(size.x));
    for (int axis = 0; axis < 3; ++axis) {
      const auto extent = static_cast<float>(size[axis]);
      if (kind == 2) insert->mutable_box()->add_half_extents(extent);
      if (kind == 3) insert->mutable_capsule()->add_half_axes(extent);
    }
  }
  return batch;
}

TEST_F(DumpRpcTest, AnEmptySceneIsOneEmptyPiece) {
  const std::vector<v1::DumpSceneResponse> pieces = pieces_of("world");
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].epoch(), get("world").epoch());
  EXPECT_EQ(pieces[0].objects_size(), 0);
  EXPECT_EQ(pieces[0].instances_size(), 0);
}

TEST_F(DumpRpcTest, ADumpSentToAnEmptySceneMakesAnEqualScene) {
  constexpr uint64_t kSeed = 31;
  SCOPED_TRACE(kSeed);
  Random random(kSeed);
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(mixed_objects(random, 2000), &ack).ok());
  ASSERT_EQ(ack.refused(), 0u) << ack.errors(0).ShortDebugString();
  v1::ChangeInstancesRequest placed = place_one("cube", 5000);
  fill(placed.mutable_place(0)->mutable_rotations(), {0.5f, 0.5f, -0.5f, 0.5f});
  fill(placed.mutable_place(0)->mutable_scales(), {2.5f});
  fill(placed.mutable_place(0)->mutable_tags(), {uint64_t{9}});
  ASSERT_TRUE(change(placed).ok());
  auto [objects, instances] = joined(pieces_of("world"));
  ASSERT_TRUE(create("copy").ok());
  ASSERT_TRUE(apply(objects, &ack, "copy").ok());
  EXPECT_EQ(ack.applied(), 2000u);
  instances.set_scene("copy");
  ASSERT_TRUE(change(instances).ok());
  const auto copy = joined(pieces_of("copy"));
  EXPECT_EQ(copy.first.SerializeAsString(), objects.SerializeAsString());
  EXPECT_EQ(copy.second.place(0).SerializeAsString(), instances.place(0).SerializeAsString());
}

TEST_F(DumpRpcTest, ManyObjectsAreSentInBoundedPiecesInOrderOfIdsAtOneRevision) {
  constexpr uint64_t kObjects = 40000;
  Random random(32);
  ASSERT_TRUE(apply(mixed_objects(random, kObjects)).ok());
  const std::vector<v1::DumpSceneResponse> pieces = pieces_of("world");
  EXPECT_GT(pieces.size(), 1u);
  uint64_t next = 1;
  for (const v1::DumpSceneResponse& piece : pieces) {
    EXPECT_LE(piece.ByteSizeLong(), kMaxPiece);
    EXPECT_EQ(piece.revision(), 1u);
    for (const v1::Insert& run : piece.objects())
      for (const uint64_t id : run.ids()) ASSERT_EQ(id, next++);
  }
  EXPECT_EQ(next, kObjects + 1);
}

TEST_F(DumpRpcTest, AnEarlierRevisionCanBeDumped) {
  ASSERT_TRUE(apply(insert_balls(1, 1)).ok());
  ASSERT_TRUE(apply(insert_balls(2, 2)).ok());
  v1::View view;
  view.set_exactly(1);
  const std::vector<v1::DumpSceneResponse> pieces = pieces_of("world", view);
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].revision(), 1u);
  ASSERT_EQ(pieces[0].objects_size(), 1);
  EXPECT_EQ(pieces[0].objects(0).ids_size(), 1);
  view.set_exactly(99);
  std::vector<v1::DumpSceneResponse> none;
  expect_refused(dump("world", &none, view), {grpc::StatusCode::OUT_OF_RANGE, v1::REASON_OUT_OF_RANGE, "view.exactly"});
  EXPECT_TRUE(none.empty());
}

}  // namespace
}  // namespace locus::test
