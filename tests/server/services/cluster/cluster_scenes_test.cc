// Three servers of a cluster on one PostgreSQL: where scenes are, what other servers answer, moves and drains. Faults
// of processes and of the engine are in tests/cluster.
#include "server/services/cluster/cluster_scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/support/cluster_servers.h"
#include "tests/support/rpc_test.h"

namespace locus::server {
namespace {

using test::becomes_true;
using test::call_in_cluster;
using test::ClusterServer;
using test::error_of;
using test::PostgresServer;
using test::set_timeout;
using testing::HasSubstr;

// Returns the reason of a refusal; UNSPECIFIED if the call succeeded.
v1::Reason reason_of(const grpc::Status& status) {
  return status.ok() ? v1::REASON_UNSPECIFIED : error_of(status).reason();
}

class ClusterScenesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!PostgresServer::installed()) GTEST_SKIP() << PostgresServer::kMissing;
    engine_ = std::make_unique<PostgresServer>();
    for (const char* const zone : {"a", "b", "c"}) start(zone);
    ASSERT_TRUE(becomes_true([&] { return describe(0).members_size() == 3; }));
  }

  void start(const std::string& zone) { servers_.push_back(std::make_unique<ClusterServer>(*engine_, zone)); }
  std::vector<ClusterServer*> servers() const {
    std::vector<ClusterServer*> all;
    for (const auto& server : servers_) all.push_back(server.get());
    return all;
  }
  v1::Cluster describe(size_t at) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::GetServerResponse response;
    EXPECT_TRUE(servers_[at]->stubs().server->GetServer(&context, {}, &response).ok());
    return response.cluster();
  }
  grpc::Status create(size_t at, const v1::CreateSceneRequest& request, v1::Scene& scene) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::CreateSceneResponse response;
    grpc::Status status = servers_[at]->stubs().scenes->CreateScene(&context, request, &response);
    scene = response.scene();
    return status;
  }
  void create(const std::string& name, size_t at = 0) {
    v1::CreateSceneRequest request;
    request.set_name(name);
    v1::Scene scene;
    const grpc::Status status = create(at, request, scene);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(scene.spec().durability(), v1::DURABILITY_REPLICATED);
  }
  // Returns the description of a scene by its leader, whose index it sets.
  v1::Scene scene(const std::string& name, size_t& leader) {
    v1::GetSceneRequest request;
    request.set_name(name);
    v1::GetSceneResponse response;
    const grpc::Status status =
        call_in_cluster(servers(), leader, [&](test::Stubs& stubs, grpc::ClientContext& context) {
          return stubs.scenes->GetScene(&context, request, &response);
        });
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.scene();
  }
  v1::Scene scene(const std::string& name) {
    size_t leader = 0;
    return scene(name, leader);
  }
  size_t leader_of(const std::string& name) {
    size_t leader = 0;
    scene(name, leader);
    return leader;
  }
  // Sends one batch of a writer: `number` inserts the object `number`. Returns the ack.
  v1::UpdateAck update(const std::string& name, uint64_t number, size_t at = 0) {
    v1::ApplyUpdatesRequest request;
    request.set_scene(name);
    v1::UpdateBatch& batch = *request.mutable_batch();
    batch.set_writer(7);
    batch.set_batch(number);
    v1::Insert& insert = *batch.add_inserts();
    insert.add_ids(number);
    insert.mutable_ball()->add_radii(1);
    for (int axis = 0; axis < 3; ++axis) insert.add_positions_f64(static_cast<double>(number));
    v1::ApplyUpdatesResponse response;
    const grpc::Status status = call_in_cluster(servers(), at, [&](test::Stubs& stubs, grpc::ClientContext& context) {
      return stubs.updates->ApplyUpdates(&context, request, &response);
    });
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.ack();
  }
  grpc::Status query(size_t at, const std::string& name, const v1::View& view, v1::QueryResult& result) {
    v1::QueryRequest request;
    request.set_scene(name);
    *request.mutable_batch()->mutable_view() = view;
    grpc::ClientContext context;
    set_timeout(context);
    v1::QueryResponse response;
    grpc::Status status = servers_[at]->stubs().queries->Query(&context, request, &response);
    result = response.result();
    return status;
  }
  grpc::Status move(size_t at, const std::string& name, const std::string& to, v1::MoveSceneResponse& response) {
    v1::MoveSceneRequest request;
    request.set_scene(name);
    request.set_to(to);
    grpc::ClientContext context;
    set_timeout(context);
    return servers_[at]->stubs().server->MoveScene(&context, request, &response);
  }

  void upload(size_t at, const std::string& name) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::UploadMeshResponse response;
    const auto writer = servers_[at]->stubs().scenes->UploadMesh(&context, &response);
    writer->Write(test::whole_mesh(name));
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
  grpc::Status change_instances(size_t at, const v1::ChangeInstancesRequest& request) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::ChangeInstancesResponse response;
    return servers_[at]->stubs().scenes->ChangeInstances(&context, request, &response);
  }
  grpc::Status delete_mesh(size_t at, const std::string& name) {
    v1::DeleteMeshRequest request;
    request.set_mesh(name);
    grpc::ClientContext context;
    set_timeout(context);
    v1::DeleteMeshResponse response;
    return servers_[at]->stubs().scenes->DeleteMesh(&context, request, &response);
  }
  std::vector<std::string> list_meshes(size_t at) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::ListMeshesResponse response;
    EXPECT_TRUE(servers_[at]->stubs().scenes->ListMeshes(&context, {}, &response).ok());
    std::vector<std::string> names;
    for (const v1::Mesh& mesh : response.meshes()) names.push_back(mesh.name());
    return names;
  }

  std::unique_ptr<PostgresServer> engine_;  // null if PostgreSQL is not installed
  std::vector<std::unique_ptr<ClusterServer>> servers_;
};

TEST_F(ClusterScenesTest, EveryServerKnowsTheMembersAndTheEngine) {
  for (size_t at = 0; at < 3; ++at) {
    ASSERT_TRUE(becomes_true([&] { return describe(at).members_size() == 3; }));
    const v1::Cluster cluster = describe(at);
    EXPECT_TRUE(cluster.engine_answers());
    EXPECT_THAT(cluster.engine(), HasSubstr(engine_->socket_folder()));
    std::set<std::string> zones;
    for (const v1::ClusterMember& member : cluster.members()) {
      zones.insert(member.zone());
      EXPECT_EQ(member.id() == cluster.member(), member.address() == servers_[at]->address());
    }
    EXPECT_EQ(zones, (std::set<std::string>{"a", "b", "c"}));
  }
}

TEST_F(ClusterScenesTest, AWrongServerNamesTheLeaderForUpdatesQueriesAndChanges) {
  create("yard");
  const size_t leader = leader_of("yard");
  const size_t other = (leader + 1) % 3;
  v1::QueryResult result;
  ASSERT_TRUE(
      becomes_true([&] { return error_of(query(other, "yard", {}, result)).reason() == v1::REASON_ELSEWHERE; }));
  const grpc::Status refused = query(other, "yard", {}, result);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(error_of(refused).addresses(), testing::ElementsAre(servers_[leader]->address()));
  EXPECT_EQ(error_of(refused).token(), 1u);
  EXPECT_THAT(refused.error_message(), HasSubstr(servers_[leader]->address())) << "people read where to go";

  v1::ApplyUpdatesRequest update;
  update.set_scene("yard");
  grpc::ClientContext context;
  set_timeout(context);
  v1::ApplyUpdatesResponse acked;
  EXPECT_EQ(reason_of(servers_[other]->stubs().updates->ApplyUpdates(&context, update, &acked)), v1::REASON_ELSEWHERE);
  v1::ChangeInstancesRequest change;
  change.set_scene("yard");
  grpc::ClientContext changing;
  set_timeout(changing);
  v1::ChangeInstancesResponse changed;
  EXPECT_EQ(reason_of(servers_[other]->stubs().scenes->ChangeInstances(&changing, change, &changed)),
            v1::REASON_ELSEWHERE);
  v1::DeleteSceneRequest deletion;
  deletion.set_name("yard");
  grpc::ClientContext deleting;
  set_timeout(deleting);
  v1::DeleteSceneResponse deleted;
  EXPECT_EQ(reason_of(servers_[other]->stubs().scenes->DeleteScene(&deleting, deletion, &deleted)),
            v1::REASON_ELSEWHERE);
  EXPECT_TRUE(query(leader, "yard", {}, result).ok());
}

TEST_F(ClusterScenesTest, NamesOfScenesBelongToTheCluster) {
  create("yard", 0);
  v1::CreateSceneRequest again;
  again.set_name("yard");
  v1::Scene found;
  for (size_t at = 0; at < 3; ++at) EXPECT_EQ(reason_of(create(at, again, found)), v1::REASON_ALREADY_EXISTS) << at;
  again.set_if_absent(true);
  const uint64_t epoch = scene("yard").epoch();
  for (size_t at = 0; at < 3; ++at) {
    EXPECT_TRUE(create(at, again, found).ok());
    EXPECT_EQ(found.epoch(), epoch);
  }
  v1::QueryResult result;
  grpc::Status missing;
  ASSERT_TRUE(becomes_true([&] {
    missing = query(1, "nowhere", {}, result);
    return missing.error_code() != grpc::StatusCode::UNAVAILABLE;
  }));
  EXPECT_EQ(reason_of(missing), v1::REASON_NOT_FOUND);
}

TEST_F(ClusterScenesTest, EveryServerListsTheScenesOfTheClusterPageByPage) {
  std::set<std::string> names;
  for (int i = 0; i < 7; ++i) {
    names.insert(absl::StrCat("scene", i));
    create(absl::StrCat("scene", i), static_cast<size_t>(i) % 3);
  }
  for (size_t at = 0; at < 3; ++at) {
    std::set<std::string> listed;
    v1::ListScenesRequest request;
    request.set_page_size(3);
    do {
      grpc::ClientContext context;
      set_timeout(context);
      v1::ListScenesResponse response;
      ASSERT_TRUE(servers_[at]->stubs().scenes->ListScenes(&context, request, &response).ok());
      EXPECT_LE(response.scenes_size(), 3);
      for (const v1::Scene& scene : response.scenes()) {
        EXPECT_TRUE(listed.insert(scene.name()).second);
        EXPECT_NE(scene.epoch(), 0u);
        EXPECT_EQ(scene.spec().durability(), v1::DURABILITY_REPLICATED);
        EXPECT_NE(scene.placement().role(), v1::SCENE_ROLE_UNSPECIFIED);
      }
      request.set_page_token(response.next_page_token());
    } while (!request.page_token().empty());
    EXPECT_EQ(listed, names) << at;
  }
}

TEST_F(ClusterScenesTest, AMovedSceneKeepsEpochRevisionsObjectsAndWriters) {
  create("yard");
  size_t leader = leader_of("yard");
  for (uint64_t number = 1; number <= 20; ++number) EXPECT_EQ(update("yard", number).revision(), number);
  const v1::Scene before = scene("yard");
  for (int times = 0; times < 3; ++times) {
    const size_t next = (leader + 1) % 3;
    v1::MoveSceneResponse moved;
    const grpc::Status status = move(leader, "yard", servers_[next]->address(), moved);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(moved.leader(), servers_[next]->address());
    const v1::Scene after = scene("yard", leader);
    EXPECT_EQ(leader, next);
    EXPECT_EQ(after.placement().role(), v1::SCENE_ROLE_LEADING);
    EXPECT_EQ(after.placement().token(), moved.token());
    EXPECT_EQ(after.epoch(), before.epoch());
    EXPECT_EQ(after.revision(), before.revision());
    EXPECT_EQ(after.objects(), 20u);
    EXPECT_TRUE(update("yard", 20).duplicate()) << "the new leader knows the writer";
  }
  EXPECT_EQ(update("yard", 21).revision(), 21u);
}

TEST_F(ClusterScenesTest, AMoveToAnUnknownMemberIsRefusedAndTheSceneStays) {
  create("yard");
  const size_t leader = leader_of("yard");
  v1::MoveSceneResponse moved;
  EXPECT_EQ(reason_of(move(leader, "yard", "127.0.0.1:1", moved)), v1::REASON_NOT_FOUND);
  EXPECT_EQ(reason_of(move(leader, "yard", servers_[leader]->address(), moved)), v1::REASON_NOT_FOUND);
  EXPECT_EQ(reason_of(move((leader + 1) % 3, "yard", "", moved)), v1::REASON_ELSEWHERE);
  EXPECT_EQ(update("yard", 1).revision(), 1u);
  EXPECT_EQ(leader_of("yard"), leader);
}

TEST_F(ClusterScenesTest, ADrainedServerHandsItsScenesOverAndNothingIsLost) {
  std::map<std::string, uint64_t> acked;
  for (int i = 0; i < 6; ++i) create(absl::StrCat("scene", i));
  for (int i = 0; i < 6; ++i)
    for (uint64_t number = 1; number <= 5; ++number)
      acked[absl::StrCat("scene", i)] = update(absl::StrCat("scene", i), number).revision();
  servers_[0]->server().drain(std::chrono::seconds(5));
  servers_.erase(servers_.begin());
  for (const auto& [name, revision] : acked) {
    EXPECT_EQ(scene(name).revision(), revision) << name;
    EXPECT_EQ(scene(name).objects(), 5u) << name;
    EXPECT_EQ(update(name, 6).revision(), revision + 1) << name;
  }
  EXPECT_TRUE(becomes_true([&] { return describe(0).members_size() == 2; }));
}

TEST_F(ClusterScenesTest, AViewOfTheLeaderIsAnsweredWhileTheEngineAnswersAndAgesAreZero) {
  create("yard");
  const size_t leader = leader_of("yard");
  v1::View view;
  view.set_leader_only(true);
  v1::QueryResult result;
  EXPECT_TRUE(query(leader, "yard", view, result).ok());
  EXPECT_EQ(result.age_ms(), 0u);
  engine_->stop(SIGKILL);
  v1::View any;
  EXPECT_TRUE(becomes_true([&] { return query(leader, "yard", any, result).ok() && result.age_ms() > 5'000; }))
      << "queries go on, and say how old they may be";
  EXPECT_EQ(reason_of(query(leader, "yard", view, result)), v1::REASON_NO_LEADER);
  any.set_max_age_ms(1'000);
  EXPECT_EQ(reason_of(query(leader, "yard", any, result)), v1::REASON_NO_LEADER);
  any.set_max_age_ms(3'600'000);
  EXPECT_TRUE(query(leader, "yard", any, result).ok());
  engine_->start();
  EXPECT_TRUE(becomes_true([&] { return query(leader, "yard", view, result).ok() && result.age_ms() == 0; }));
  EXPECT_EQ(update("yard", 1).revision(), 1u) << "nobody has lost the scene";
  EXPECT_EQ(leader_of("yard"), leader);
}

TEST_F(ClusterScenesTest, ASceneInMemoryBeginsAnotherEpochWhenItMoves) {
  v1::CreateSceneRequest request;
  request.set_name("yard");
  request.mutable_spec()->set_durability(v1::DURABILITY_MEMORY);
  v1::Scene created;
  ASSERT_TRUE(create(0, request, created).ok());
  size_t leader = leader_of("yard");
  const uint64_t epoch = scene("yard").epoch();
  EXPECT_EQ(update("yard", 1).revision(), 1u);
  v1::MoveSceneResponse moved;
  ASSERT_TRUE(move(leader, "yard", "", moved).ok());
  const v1::Scene after = scene("yard", leader);
  EXPECT_NE(after.epoch(), epoch);
  EXPECT_EQ(after.objects(), 0u);
  EXPECT_EQ(after.spec().durability(), v1::DURABILITY_MEMORY);
}

TEST_F(ClusterScenesTest, QueriesGoOnWhileUpdatesWaitForAnEngineThatIsAway) {
  create("yard");
  const size_t leader = leader_of("yard");
  EXPECT_EQ(update("yard", 1, leader).revision(), 1u);
  engine_->stop(SIGKILL);
  std::vector<std::thread> writers;
  std::atomic<int> ended{0};
  for (uint64_t i = 0; i < 8; ++i)
    writers.emplace_back([&, writer = 100 + i] {
      v1::ApplyUpdatesRequest request;
      request.set_scene("yard");
      request.mutable_batch()->set_writer(writer);
      request.mutable_batch()->set_batch(1);
      request.mutable_batch()->add_remove_ids(1);
      grpc::ClientContext context;
      set_timeout(context);
      v1::ApplyUpdatesResponse response;
      EXPECT_FALSE(servers_[leader]->stubs().updates->ApplyUpdates(&context, request, &response).ok())
          << "acknowledged without an engine";
      ++ended;
    });
  v1::QueryResult result;
  int answered = 0;
  while (ended < 8) {
    grpc::ClientContext context;
    set_timeout(context, std::chrono::milliseconds(2'000));  // far less than the updates wait
    v1::QueryRequest request;
    request.set_scene("yard");
    v1::QueryResponse response;
    const grpc::Status status = servers_[leader]->stubs().queries->Query(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    if (!status.ok()) break;
    ++answered;
  }
  for (std::thread& writer : writers) writer.join();
  EXPECT_GT(answered, 0);
  engine_->start();
  EXPECT_EQ(update("yard", 2).revision(), 2u) << "nothing that was refused was applied";
}

TEST_F(ClusterScenesTest, AMeshIsKnownToEveryServerAndCannotBeDeletedWhileAnyUsesIt) {
  for (const v1::Durability durability : {v1::DURABILITY_REPLICATED, v1::DURABILITY_MEMORY}) {
    const std::string name = durability == v1::DURABILITY_MEMORY ? "memory" : "yard";
    v1::CreateSceneRequest request;
    request.set_name(name);
    request.mutable_spec()->set_durability(durability);
    v1::Scene created;
    ASSERT_TRUE(create(0, request, created).ok());
    const size_t leader = leader_of(name);
    const size_t uploader = (leader + 1) % 3, deleter = (leader + 2) % 3;
    upload(uploader, "cube");
    v1::ChangeInstancesRequest change;
    change.set_scene(name);
    v1::Placement& place = *change.add_place();
    place.set_mesh("cube");
    place.add_ids(5);
    for (int axis = 0; axis < 3; ++axis) place.add_translations(0);
    const grpc::Status placed = change_instances(leader, change);
    ASSERT_TRUE(placed.ok()) << placed.error_message();
    EXPECT_EQ(reason_of(delete_mesh(deleter, "cube")), v1::REASON_IN_USE);
    EXPECT_EQ(scene(name).instances(), 1u);
    EXPECT_EQ(list_meshes(deleter), std::vector<std::string>{"cube"});
    v1::ChangeInstancesRequest removal;
    removal.set_scene(name);
    removal.add_remove_ids(5);
    ASSERT_TRUE(change_instances(leader, removal).ok());
    const grpc::Status deleted = delete_mesh(deleter, "cube");
    EXPECT_TRUE(deleted.ok()) << deleted.error_message();
    EXPECT_EQ(reason_of(change_instances(leader, change)), v1::REASON_NOT_FOUND) << "not from the leader's memory";
    EXPECT_EQ(reason_of(delete_mesh(uploader, "cube")), v1::REASON_NOT_FOUND);
    EXPECT_TRUE(list_meshes(leader).empty());
  }
}

TEST_F(ClusterScenesTest, ASceneThatBeginsWithInstancesOfAnotherClaimsItsMeshes) {
  create("yard");
  const size_t leader = leader_of("yard");
  upload(leader, "cube");
  v1::ChangeInstancesRequest change;
  change.set_scene("yard");
  v1::Placement& place = *change.add_place();
  place.set_mesh("cube");
  place.add_ids(5);
  for (int axis = 0; axis < 3; ++axis) place.add_translations(0);
  ASSERT_TRUE(change_instances(leader, change).ok());
  v1::CreateSceneRequest copy;
  copy.set_name("copy");
  copy.mutable_spec()->set_static_from("yard");
  v1::Scene created;
  EXPECT_EQ(reason_of(create((leader + 1) % 3, copy, created)), v1::REASON_ELSEWHERE) << "its instances are elsewhere";
  const grpc::Status copied = create(leader, copy, created);
  ASSERT_TRUE(copied.ok()) << copied.error_message();
  v1::ChangeInstancesRequest removal;
  removal.set_scene("yard");
  removal.add_remove_ids(5);
  ASSERT_TRUE(change_instances(leader, removal).ok());
  EXPECT_EQ(reason_of(delete_mesh(leader, "cube")), v1::REASON_IN_USE);
  EXPECT_EQ(scene("copy").instances(), 1u);
}

TEST_F(ClusterScenesTest, ALabelOfASceneInMemoryStaysWhenItMoves) {
  v1::CreateSceneRequest request;
  request.set_name("yard");
  request.mutable_spec()->set_durability(v1::DURABILITY_MEMORY);
  v1::Scene created;
  ASSERT_TRUE(create(0, request, created).ok());
  const size_t leader = leader_of("yard");
  v1::UpdateSceneRequest labels;
  labels.set_name("yard");
  labels.add_fields("labels");
  (*labels.mutable_labels())["kind"] = "test";
  grpc::ClientContext context;
  set_timeout(context);
  v1::UpdateSceneResponse updated;
  ASSERT_TRUE(servers_[leader]->stubs().scenes->UpdateScene(&context, labels, &updated).ok());
  v1::MoveSceneResponse moved;
  ASSERT_TRUE(move(leader, "yard", "", moved).ok());
  EXPECT_EQ(scene("yard").spec().labels().at("kind"), "test");
}

TEST_F(ClusterScenesTest, DurabilityOnOneMachineIsNotServed) {
  v1::CreateSceneRequest request;
  request.set_name("yard");
  request.mutable_spec()->set_durability(v1::DURABILITY_LOCAL);
  v1::Scene created;
  EXPECT_EQ(reason_of(create(0, request, created)), v1::REASON_NOT_SERVED);
}

TEST_F(ClusterScenesTest, ADeletedSceneIsGoneEverywhereAndItsNameIsFree) {
  create("yard");
  const uint64_t epoch = scene("yard").epoch();
  v1::DeleteSceneRequest deletion;
  deletion.set_name("yard");
  v1::DeleteSceneResponse deleted;
  size_t at = 0;
  const grpc::Status status = call_in_cluster(servers(), at, [&](test::Stubs& stubs, grpc::ClientContext& context) {
    return stubs.scenes->DeleteScene(&context, deletion, &deleted);
  });
  ASSERT_TRUE(status.ok()) << status.error_message();
  v1::QueryResult result;
  for (size_t server = 0; server < 3; ++server)
    EXPECT_TRUE(becomes_true([&] {
      return error_of(query(server, "yard", {}, result)).reason() == v1::REASON_NOT_FOUND;
    })) << server;
  create("yard", 1);
  EXPECT_NE(scene("yard").epoch(), epoch);
  EXPECT_EQ(update("yard", 1).revision(), 1u);
}

}  // namespace
}  // namespace locus::server
