// A daemon with a data directory: state after a restart, reports of damage, and repair.
#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "tests/support/kept_daemon.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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

  grpc::Status upload(const v1::UploadMeshRequest& mesh) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::UploadMeshResponse uploaded;
    const auto upload = stubs().scenes->UploadMesh(&context, &uploaded);
    upload->Write(mesh);
    upload->WritesDone();
    return upload->Finish();
  }

  // Returns the list of meshes, with parts and numbers of uses, as text; without their sizes in bytes.
  std::string meshes_now() {
    v1::ListMeshesResponse meshes;
    EXPECT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::ListMeshes, v1::ListMeshesRequest(), &meshes).ok());
    for (v1::Mesh& mesh : *meshes.mutable_meshes()) mesh.clear_bytes();
    return meshes.DebugString();
  }

  void place_cube(const std::string& scene) {
    ASSERT_TRUE(upload(whole_mesh("cube")).ok());
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

  // Moves points 1 to 100 at every tick until a snapshot of the scene is on the disk.
  void live_until_a_snapshot(const std::string& scene) {
    const auto written = [this] { return daemon_.log().find("snapshot written") != std::string::npos; };
    for (uint64_t tick = 1; tick <= 2000 && !written(); ++tick) {
      v1::UpdateBatch batch;
      for (uint64_t id = 1; id <= 100; ++id) *batch.add_inserts() = point(id, static_cast<double>(tick)).inserts(0);
      batch.set_upsert(true);
      batch.set_tick(tick);
      ASSERT_TRUE(apply(scene, batch).ok());
    }
    ASSERT_TRUE(written());
  }

  grpc::Status look_up_at(const std::string& scene, uint64_t tick) {
    v1::QueryRequest request;
    request.set_scene(scene);
    v1::QueryBlock* block = request.mutable_batch()->add_blocks();
    block->mutable_lookup()->add_ids(1);
    block->add_as_of_ticks(tick);
    v1::QueryResponse response;
    return call(*stubs().queries, &v1::QueryService::Stub::Query, request, &response);
  }

  // Changes a byte in the middle of the largest table file. That file contains the records, because the daemon writes
  // all records into tables when it ends.
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
  // If a writer sends its last batch again, because the ack was lost, the ack is marked as duplicate.
  v1::UpdateAck ack;
  ASSERT_TRUE(apply("arena", numbered(20, point(20, 20)), &ack).ok());
  EXPECT_TRUE(ack.duplicate());
  ASSERT_TRUE(apply("arena", numbered(21, point(21, 21)), &ack).ok());
  EXPECT_EQ(ack.revision(), before.revision() + 1);
}

TEST_F(DurabilityTest, NamesOfEqualBytesKeepTheirPartsAndUsesOverRestarts) {
  daemon_.start();
  create_scene(stubs(), "arena");
  for (const char* const name : {"a", "b"}) {
    v1::UploadMeshRequest mesh = whole_mesh(name);
    mesh.add_parts()->set_name(absl::StrCat("part of ", name));
    ASSERT_TRUE(upload(mesh).ok());
  }
  v1::ChangeInstancesRequest request = place_one("b", 100, "arena");
  v1::ChangeInstancesResponse response;
  ASSERT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::ChangeInstances, request, &response).ok());
  v1::SceneSpec spec;
  spec.set_static_from("arena");
  create_scene(stubs(), "twin", spec);
  const std::string meshes = meshes_now(), dump = dump_of(stubs(), "arena"), twin = dump_of(stubs(), "twin");
  EXPECT_THAT(meshes, HasSubstr("part of b"));
  EXPECT_THAT(dump, HasSubstr("mesh: \"b\""));
  for (const bool killed : {true, false}) {
    if (killed) {
      daemon_.kill();
    } else {
      EXPECT_EQ(daemon_.stop(), 0);
    }
    EXPECT_EQ(daemon_.maintain("check"), 0) << daemon_.printed();
    daemon_.start();
    EXPECT_EQ(meshes_now(), meshes);
    EXPECT_EQ(dump_of(stubs(), "arena"), dump);
    EXPECT_EQ(dump_of(stubs(), "twin"), twin);
  }
  v1::DeleteMeshRequest removal;
  v1::DeleteMeshResponse deleted;
  removal.set_mesh("b");
  expect_refused(call(*stubs().scenes, &v1::SceneService::Stub::DeleteMesh, removal, &deleted),
                 {grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_IN_USE, "mesh"});
  removal.set_mesh("a");
  ASSERT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::DeleteMesh, removal, &deleted).ok());
  daemon_.kill();
  daemon_.start();
  EXPECT_EQ(dump_of(stubs(), "arena"), dump);
  EXPECT_THAT(meshes_now(), HasSubstr("part of b"));
  EXPECT_THAT(meshes_now(), Not(HasSubstr("part of a")));
}

TEST_F(DurabilityTest, RepairKeepsThePartsOfEveryName) {
  daemon_.start();
  create_scene(stubs(), "arena");
  for (const char* const name : {"a", "b"}) {
    v1::UploadMeshRequest mesh = whole_mesh(name);
    mesh.add_parts()->set_name(absl::StrCat("part of ", name));
    ASSERT_TRUE(upload(mesh).ok());
  }
  const std::string meshes = meshes_now();
  EXPECT_EQ(daemon_.stop(), 0);
  // Without the durable marker, all data counts as damaged. The repair copies the intact data.
  std::filesystem::remove(std::filesystem::path(daemon_.directory()) / "HIGH_WATER");
  EXPECT_EQ(daemon_.maintain("repair"), 0) << daemon_.printed();
  EXPECT_EQ(daemon_.maintain("check"), 0) << daemon_.printed();
  daemon_.start();
  EXPECT_EQ(meshes_now(), meshes);
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
  // The records of the scene `other` are stored after the byte that will be damaged.
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

  // Starts the daemon again: it must report the same damage.
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

TEST_F(DurabilityTest, AfterARestartThePastBeginsAtTheSnapshotAndARefusalSaysWhy) {
  daemon_.set_options({"--snapshot-after", "64KiB"});
  daemon_.start();
  v1::SceneSpec spec;
  spec.set_history_ticks(10000);
  create_scene(stubs(), "arena", spec);
  live_until_a_snapshot("arena");
  EXPECT_TRUE(look_up_at("arena", 1).ok());
  EXPECT_EQ(daemon_.stop(), 0);
  daemon_.start();
  const v1::Scene scene = get_scene(stubs(), "arena");
  ASSERT_GT(scene.oldest_tick(), 1u);
  EXPECT_TRUE(look_up_at("arena", scene.oldest_tick()).ok());
  const grpc::Status refused = look_up_at("arena", 1);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_THAT(refused.error_message(), HasSubstr("the server has restarted"));
  EXPECT_THAT(refused.error_message(), ::testing::Not(HasSubstr("history_ticks")));
}

}  // namespace
}  // namespace locus::test
