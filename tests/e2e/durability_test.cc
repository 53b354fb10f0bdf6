// A daemon with a data directory: state after a restart, reports of damage, and repair.
#include <filesystem>
#include <fstream>

#include "tests/support/kept_daemon.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

class DurabilityTest : public ::testing::Test {
 protected:
  Stubs& stubs() { return daemon_.stubs(); }

  template <class Stub, class Request, class Response>
  grpc::Status call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response* response) {
    grpc::ClientContext context;
    set_timeout(context);
    return (stub.*method)(&context, request, response);
  }

  grpc::Status apply(const std::string& scene, const v1::UpdateBatch& batch, v1::UpdateAck* ack = nullptr) {
    v1::ApplyUpdatesRequest request;
    request.set_scene(scene);
    *request.mutable_batch() = batch;
    v1::ApplyUpdatesResponse response;
    const grpc::Status status = call(*stubs().updates, &v1::UpdateService::Stub::ApplyUpdates, request, &response);
    if (ack != nullptr) *ack = response.ack();
    return status;
  }

  grpc::Status look(const std::string& scene) {
    v1::GetSceneRequest request;
    request.set_name(scene);
    v1::GetSceneResponse response;
    return call(*stubs().scenes, &v1::SceneService::Stub::GetScene, request, &response);
  }

  void remove(const std::string& scene) {
    v1::DeleteSceneRequest request;
    request.set_name(scene);
    v1::DeleteSceneResponse response;
    const grpc::Status status = call(*stubs().scenes, &v1::SceneService::Stub::DeleteScene, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }

  void place_cube(const std::string& scene) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::UploadMeshResponse uploaded;
    const auto upload = stubs().scenes->UploadMesh(&context, &uploaded);
    ASSERT_TRUE(upload->Write(whole_mesh("cube")));
    upload->WritesDone();
    ASSERT_TRUE(upload->Finish().ok());
    v1::ChangeInstancesRequest request;
    request.set_scene(scene);
    v1::Placement* place = request.add_place();
    place->set_mesh("cube");
    for (const double x : {5.0, 0.0, 0.0, 9.0, 0.25, 0.0}) place->add_translations(x);
    v1::ChangeInstancesResponse response;
    const grpc::Status status = call(*stubs().scenes, &v1::SceneService::Stub::ChangeInstances, request, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
  }

  static v1::UpdateBatch numbered(uint64_t number, const v1::UpdateBatch& from) {
    v1::UpdateBatch batch = from;
    batch.set_writer(7);
    batch.set_batch(number);
    return batch;
  }
  static v1::UpdateBatch point(uint64_t id, double x) {
    v1::UpdateBatch batch;
    v1::Insert* insert = batch.add_inserts();
    insert->mutable_point();
    insert->add_ids(id);
    for (const double at : {x, 0.5, 0.25}) insert->add_positions_f64(at);
    return batch;
  }

  std::string answer_to_a_ray(const std::string& scene) {
    v1::QueryRequest request;
    request.set_scene(scene);
    *request.mutable_batch() = ray_along_x();
    v1::QueryResponse response;
    EXPECT_TRUE(call(*stubs().queries, &v1::QueryService::Stub::Query, request, &response).ok());
    return response.result().DebugString();
  }

  // Changes a byte in the middle of the largest table file. It has the records, which are written into tables when the
  // daemon ends.
  void damage_the_log() {
    std::filesystem::path largest;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(daemon_.directory()))
      if (entry.path().extension() == ".sst" && (largest.empty() || entry.file_size() > file_size(largest)))
        largest = entry.path();
    ASSERT_FALSE(largest.empty());
    std::string bytes = text_of(largest);
    bytes[bytes.size() / 2] ^= 0x40;
    std::ofstream(largest, std::ios::binary) << bytes;
  }

  KeptDaemon daemon_;
};

TEST_F(DurabilityTest, ARestartLeavesEverythingAsItWas) {
  daemon_.start();
  v1::SceneSpec spec;
  (*spec.mutable_labels())["level"] = "7";
  EXPECT_EQ(create_scene(stubs(), "arena", spec).spec().durability(), v1::DURABILITY_LOCAL);
  place_cube("arena");
  for (uint64_t i = 1; i <= 20; ++i) ASSERT_TRUE(apply("arena", numbered(i, point(i, static_cast<double>(i)))).ok());
  spec.set_static_from("arena");
  create_scene(stubs(), "twin", spec);
  const v1::Scene before = get_scene(stubs(), "arena");
  const std::string dump = dump_of(stubs(), "arena"), twin = dump_of(stubs(), "twin");
  const std::string answer = answer_to_a_ray("arena");
  EXPECT_EQ(daemon_.stop(), 0);

  daemon_.start();
  const v1::Scene after = get_scene(stubs(), "arena");
  EXPECT_EQ(after.epoch(), before.epoch());
  EXPECT_EQ(after.revision(), before.revision());
  EXPECT_EQ(after.spec().DebugString(), before.spec().DebugString());
  EXPECT_EQ(dump_of(stubs(), "arena"), dump);
  EXPECT_EQ(dump_of(stubs(), "twin"), twin);
  EXPECT_EQ(answer_to_a_ray("arena"), answer);
  EXPECT_THAT(daemon_.log(), HasSubstr("scene recovered"));
  // A writer that sends its last batch again, because the ack was lost, gets an ack marked as duplicate.
  v1::UpdateAck ack;
  ASSERT_TRUE(apply("arena", numbered(20, point(20, 20)), &ack).ok());
  EXPECT_TRUE(ack.duplicate());
  ASSERT_TRUE(apply("arena", numbered(21, point(21, 21)), &ack).ok());
  EXPECT_EQ(ack.revision(), before.revision() + 1);
}

TEST_F(DurabilityTest, TreesAreRestoredFromTheirTopologiesAndRebuiltIfThoseAreDamagedOrMissing) {
  daemon_.start();
  create_scene(stubs(), "arena");
  place_cube("arena");
  const std::string answer = answer_to_a_ray("arena");
  const std::filesystem::path outlines = std::filesystem::path(daemon_.directory()) / "outlines";
  const auto expect_tree = [&](const std::string& how) {
    daemon_.kill();
    daemon_.start();
    EXPECT_THAT(daemon_.log(), HasSubstr("tree=" + how));
    EXPECT_EQ(answer_to_a_ray("arena"), answer);
  };
  expect_tree("restored");
  for (const auto& entry : std::filesystem::directory_iterator(outlines)) std::ofstream(entry.path()) << "damaged";
  expect_tree("built");
  expect_tree("restored");
  std::filesystem::remove_all(outlines);
  expect_tree("built");
  expect_tree("restored");
}

TEST_F(DurabilityTest, DeletedScenesAndMeshesStayDeleted) {
  daemon_.start();
  create_scene(stubs(), "arena");
  place_cube("arena");
  remove("arena");
  v1::DeleteMeshRequest mesh;
  mesh.set_mesh("cube");
  v1::DeleteMeshResponse deleted;
  ASSERT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::DeleteMesh, mesh, &deleted).ok());
  daemon_.kill();
  daemon_.start();
  EXPECT_EQ(look("arena").error_code(), grpc::StatusCode::NOT_FOUND);
  v1::ListMeshesResponse meshes;
  ASSERT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::ListMeshes, v1::ListMeshesRequest(), &meshes).ok());
  EXPECT_EQ(meshes.meshes_size(), 0);
}

TEST_F(DurabilityTest, AMemoryDurableSceneKeepsItsEpochAfterACleanEndAndGetsANewOneAfterAKill) {
  daemon_.start();
  v1::SceneSpec spec;
  spec.set_durability(v1::DURABILITY_MEMORY);
  const uint64_t epoch = create_scene(stubs(), "arena", spec).epoch();
  ASSERT_TRUE(apply("arena", point(1, 1)).ok());
  EXPECT_EQ(daemon_.stop(), 0);
  daemon_.start();
  EXPECT_EQ(get_scene(stubs(), "arena").epoch(), epoch);
  EXPECT_EQ(points_of(stubs(), "arena").size(), 1u);
  ASSERT_TRUE(apply("arena", point(2, 2)).ok());
  daemon_.kill();
  daemon_.start();
  EXPECT_NE(get_scene(stubs(), "arena").epoch(), epoch);
  EXPECT_GE(points_of(stubs(), "arena").size(), 1u);
}

TEST_F(DurabilityTest, ThePinnedLimitFollowsTheCurrentOptions) {
  daemon_.set_options({"--pinned-limit", "64MiB"});
  daemon_.start();
  create_scene(daemon_.stubs(), "arena");
  EXPECT_EQ(get_scene(daemon_.stubs(), "arena").max_pinned_bytes(), uint64_t{64} << 20);
  EXPECT_EQ(daemon_.stop(), 0);
  daemon_.set_options({"--pinned-limit", "96MiB"});
  daemon_.start();
  EXPECT_EQ(get_scene(daemon_.stubs(), "arena").max_pinned_bytes(), uint64_t{96} << 20);
}

TEST_F(DurabilityTest, ASecondDaemonOnTheDirectoryIsRefused) {
  daemon_.start();
  EXPECT_EQ(daemon_.maintain("check"), 1);
  EXPECT_THAT(daemon_.printed(), HasSubstr("in use"));
}

TEST_F(DurabilityTest, ADamagedSceneIsRefusedTheOthersAreServedAndRepairReportsTheLoss) {
  daemon_.start();
  const uint64_t epoch = create_scene(stubs(), "arena").epoch();
  for (uint64_t i = 1; i <= 200; ++i) ASSERT_TRUE(apply("arena", point(i, 1)).ok());
  // This scene's records lie behind the byte that is damaged.
  create_scene(stubs(), "other");
  EXPECT_EQ(daemon_.stop(), 0);
  EXPECT_EQ(daemon_.maintain("check"), 0) << daemon_.printed();
  EXPECT_THAT(daemon_.printed(), HasSubstr("arena"));
  damage_the_log();
  EXPECT_EQ(daemon_.maintain("check"), 1);
  EXPECT_THAT(daemon_.printed(), HasSubstr("arena"));

  daemon_.start();
  expect_refused(look("arena"), {grpc::StatusCode::DATA_LOSS, v1::REASON_DAMAGED, "scene"});
  expect_refused(apply("arena", point(1, 1)), {grpc::StatusCode::DATA_LOSS, v1::REASON_DAMAGED, "scene"});
  EXPECT_THAT(std::string(look("arena").error_message()), HasSubstr("locusd check"));
  EXPECT_TRUE(apply("other", point(1, 1)).ok());
  v1::ListScenesResponse scenes;
  ASSERT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::ListScenes, v1::ListScenesRequest(), &scenes).ok());
  ASSERT_EQ(scenes.scenes_size(), 2);
  EXPECT_EQ(scenes.scenes(0).state(), v1::SCENE_STATE_DAMAGED);
  EXPECT_EQ(scenes.scenes(1).state(), v1::SCENE_STATE_READY);
  EXPECT_EQ(daemon_.stop(), 0);

  // A second start reports the same damage.
  daemon_.start();
  expect_refused(look("arena"), {grpc::StatusCode::DATA_LOSS, v1::REASON_DAMAGED, "scene"});
  EXPECT_EQ(daemon_.stop(), 0);

  EXPECT_EQ(daemon_.maintain("repair"), 0) << daemon_.printed();
  EXPECT_THAT(daemon_.printed(), HasSubstr("scene arena"));
  EXPECT_THAT(daemon_.printed(), HasSubstr("LOST"));
  EXPECT_EQ(daemon_.maintain("check"), 0) << daemon_.printed();
  daemon_.start();
  EXPECT_NE(get_scene(stubs(), "arena").epoch(), epoch) << "something is lost, but the epoch does not say so";
  // The repaired scene has a prefix of the acknowledged updates.
  const std::map<uint64_t, PlacedPoint> left = points_of(stubs(), "arena");
  EXPECT_LT(left.size(), 200u);
  for (uint64_t i = 1; i <= left.size(); ++i) EXPECT_EQ(left.count(i), 1u);
  EXPECT_EQ(points_of(stubs(), "other").size(), 1u);
}

}  // namespace
}  // namespace locus::test
