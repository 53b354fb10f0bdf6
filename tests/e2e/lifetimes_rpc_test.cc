// Scenes with idle_ttl_s, meshes of scenes with mesh_grace_s, and leases of writers: what keeps them, when they go, and
// restarts. Tests wait until a control scene of the same time is gone, so that they depend on no time of their own.
#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <thread>

#include "absl/strings/match.h"
#include "core/base/limits.h"
#include "tests/support/kept_daemon.h"
#include "tests/support/rpc_test.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;

v1::SceneSpec idle_spec(uint32_t seconds = 1) {
  v1::SceneSpec spec;
  spec.set_idle_ttl_s(seconds);
  return spec;
}

v1::SceneSpec grace_spec(uint32_t seconds = 1) {
  v1::SceneSpec spec;
  spec.set_mesh_grace_s(seconds);
  return spec;
}

std::vector<std::string> scene_names(Stubs& stubs) {
  grpc::ClientContext context;
  set_timeout(context);
  v1::ListScenesResponse scenes;
  EXPECT_TRUE(stubs.scenes->ListScenes(&context, {}, &scenes).ok());
  std::vector<std::string> names;
  for (const v1::Scene& scene : scenes.scenes()) names.push_back(scene.name());
  return names;
}

std::vector<std::string> mesh_names(Stubs& stubs) {
  grpc::ClientContext context;
  set_timeout(context);
  v1::ListMeshesResponse meshes;
  EXPECT_TRUE(stubs.scenes->ListMeshes(&context, {}, &meshes).ok());
  std::vector<std::string> names;
  for (const v1::Mesh& mesh : meshes.meshes()) names.push_back(mesh.name());
  return names;
}

// Waits until `names` returns a list without `name`; the test's time limit ends a wait for ever.
void wait_until_gone(const std::function<std::vector<std::string>()>& names, const std::string& name) {
  while (true) {
    const std::vector<std::string> all = names();
    if (std::find(all.begin(), all.end(), name) == all.end()) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}
void wait_until_scene_is_gone(Stubs& stubs, const std::string& name) {
  wait_until_gone([&stubs] { return scene_names(stubs); }, name);
}
void wait_until_mesh_is_gone(Stubs& stubs, const std::string& name) {
  wait_until_gone([&stubs] { return mesh_names(stubs); }, name);
}

class LifetimesRpcTest : public RpcTest {
 protected:
  // Waits until a scene that is created now and has idle_ttl_s = 1 is gone.
  void outlive_a_control() {
    ASSERT_TRUE(create("control", idle_spec()).ok());
    wait_until_scene_is_gone(stubs(), "control");
  }
};

TEST_F(LifetimesRpcTest, AnIdleSceneIsDeletedLikeByDeleteScene) {
  v1::Scene scene;
  ASSERT_TRUE(create("idle", idle_spec(), &scene).ok());
  EXPECT_EQ(scene.spec().idle_ttl_s(), 1u);
  wait_until_scene_is_gone(stubs(), "idle");
  expect_refused(apply({}, nullptr, "idle"), {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "scene"});
  v1::Scene again;
  ASSERT_TRUE(create("idle", {}, &again).ok());
  EXPECT_NE(again.epoch(), scene.epoch());
  EXPECT_THAT(scene_names(stubs()), ElementsAre("idle", "world"));
}

TEST_F(LifetimesRpcTest, AnOpenStreamKeepsItsSceneUntilItEnds) {
  ASSERT_TRUE(create("streamed", idle_spec()).ok());
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().updates->StreamUpdates(&context);
  v1::StreamUpdatesRequest request;
  request.set_scene("streamed");
  request.mutable_batch();
  v1::StreamUpdatesResponse response;
  ASSERT_TRUE(stream->Write(request));
  ASSERT_TRUE(stream->Read(&response));
  outlive_a_control();
  EXPECT_THAT(scene_names(stubs()), ElementsAre("streamed", "world"));
  request.set_scene("");
  ASSERT_TRUE(stream->Write(request));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_FALSE(response.has_error()) << response.ShortDebugString();
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
  wait_until_scene_is_gone(stubs(), "streamed");
}

TEST_F(LifetimesRpcTest, AQueryThatWaitsKeepsItsScene) {
  ASSERT_TRUE(create("awaited", idle_spec()).ok());
  grpc::ClientContext context;
  set_timeout(context);
  std::thread waiter([&] {
    v1::QueryRequest request;
    request.set_scene("awaited");
    *request.mutable_batch() = ray_along_x();
    request.mutable_batch()->mutable_view()->set_at_least(1);
    v1::QueryResponse response;
    const grpc::Status status = stubs().queries->Query(&context, request, &response);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED) << status.error_message();
  });
  outlive_a_control();
  EXPECT_THAT(scene_names(stubs()), ElementsAre("awaited", "world"));
  context.TryCancel();
  waiter.join();
  wait_until_scene_is_gone(stubs(), "awaited");
}

TEST_F(LifetimesRpcTest, TheDeletionOfAnIdleSceneGivesBackItsPlace) {
  server::ServerConfig config = test_config();
  config.max_scenes = 1;
  RunningServer small(config);
  create_scene(small.stubs(), "first", idle_spec());
  wait_until_scene_is_gone(small.stubs(), "first");
  create_scene(small.stubs(), "second");
}

TEST_F(LifetimesRpcTest, AMeshThatNoSceneUsesAnyMoreIsDeleted) {
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  ASSERT_TRUE(upload({whole_mesh("alias")}).ok());
  v1::Scene scene;
  ASSERT_TRUE(create("asking", grace_spec(), &scene).ok());
  EXPECT_EQ(scene.spec().mesh_grace_s(), 1u);
  ASSERT_TRUE(change(place_one("cube", 1, "asking")).ok());
  ASSERT_TRUE(change(place_one("alias", 1)).ok());
  outlive_a_control();
  EXPECT_THAT(mesh_names(stubs()), ElementsAre("alias", "cube"));
  v1::ChangeInstancesRequest removal;
  removal.set_scene("asking");
  removal.add_remove_ids(1);
  ASSERT_TRUE(change(removal).ok());
  wait_until_mesh_is_gone(stubs(), "cube");
  EXPECT_THAT(mesh_names(stubs()), ElementsAre("alias")) << "its scene does not ask, and it is in use";
  expect_refused(change(place_one("cube", 2, "asking")),
                 {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "place[0].mesh"});
}

TEST_F(LifetimesRpcTest, TheMeshesOfADeletedSceneAreDeleted) {
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  v1::SceneSpec spec = grace_spec();
  spec.set_idle_ttl_s(1);
  ASSERT_TRUE(create("asking", spec).ok());
  ASSERT_TRUE(change(place_one("cube", 1, "asking")).ok());
  wait_until_mesh_is_gone(stubs(), "cube");
  EXPECT_THAT(scene_names(stubs()), ElementsAre("world"));
}

TEST_F(LifetimesRpcTest, LifetimesBeyondTheLimitAreRefused) {
  const auto expect_limit = [&](const v1::SceneSpec& spec, const std::string& field) {
    const v1::Error error = error_of(create("arena", spec));
    expect_error(error, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "spec." + field});
    EXPECT_EQ(error.limit(), field);
    EXPECT_EQ(error.limit_value(), limits::kMaxLifetimeSeconds);
    EXPECT_EQ(error.asked(), limits::kMaxLifetimeSeconds + 1);
  };
  expect_limit(idle_spec(limits::kMaxLifetimeSeconds + 1), "idle_ttl_s");
  expect_limit(grace_spec(limits::kMaxLifetimeSeconds + 1), "mesh_grace_s");
  EXPECT_THAT(scene_names(stubs()), ElementsAre("world"));
  v1::SceneSpec longest = idle_spec(limits::kMaxLifetimeSeconds);
  longest.set_mesh_grace_s(limits::kMaxLifetimeSeconds);
  EXPECT_TRUE(create("arena", longest).ok());
}

v1::UpdateBatch leased(v1::UpdateBatch batch, uint64_t writer, uint64_t number, uint32_t lease_ms) {
  batch.set_writer(writer);
  batch.set_batch(number);
  batch.set_lease_ms(lease_ms);
  return batch;
}

TEST_F(LifetimesRpcTest, TheObjectsOfASilentWriterGoAsOneRevision) {
  ASSERT_TRUE(apply(insert_balls(100, 101)).ok());
  v1::UpdateAck ack;
  ASSERT_TRUE(apply(leased(insert_balls(1, 20), 7, 1, 50), &ack).ok());
  v1::Scene scene = get("world");
  while (scene.objects() == 22) scene = get("world");
  EXPECT_EQ(scene.objects(), 2u) << "all go together";
  EXPECT_EQ(scene.revision(), ack.revision() + 1);
  EXPECT_TRUE(apply(leased({}, 7, 1, 50), &ack).ok());
  EXPECT_TRUE(ack.duplicate());
  EXPECT_EQ(get("world").objects(), 2u) << "a repeated batch is not applied again";
}

// Stream of writer 7, which has inserted one ball with a lease. Writer 8, whose lease is as long and began later, has
// inserted two.
class LeasedStreamTest : public LifetimesRpcTest {
 protected:
  void SetUp() override {
    LifetimesRpcTest::SetUp();
    constexpr uint32_t kLength = 2000;
    set_timeout(context_);
    stream_ = stubs().updates->StreamUpdates(&context_);
    request_.set_scene("world");
    *request_.mutable_batch() = leased(insert_balls(1, 1), 7, 1, kLength);
    ASSERT_TRUE(send());
    ASSERT_TRUE(apply(leased(insert_balls(2, 3), 8, 1, kLength)).ok());
  }
  // Sends request_ and reads response_. Returns whether both succeeded.
  bool send() { return stream_->Write(request_) && stream_->Read(&response_); }

  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::StreamUpdatesRequest, v1::StreamUpdatesResponse>> stream_;
  v1::StreamUpdatesRequest request_;
  v1::StreamUpdatesResponse response_;
};

// The lease of writer 7 is renewed until that of writer 8, which is as long and began later, has ended.
TEST_F(LeasedStreamTest, BatchesOnAStreamRenewALease) {
  for (uint64_t number = 2; get("world").objects() == 3; ++number) {
    *request_.mutable_batch() = leased({}, 7, number, 0);
    ASSERT_TRUE(send());
    ASSERT_FALSE(response_.has_error()) << response_.ShortDebugString();
  }
  EXPECT_EQ(get("world").objects(), 1u) << "the objects of writer 8 are gone";
  stream_->WritesDone();
  EXPECT_TRUE(stream_->Finish().ok());
  while (get("world").objects() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

// A writer that sends one revision as many messages is not silent. The lease of writer 8 is as long and began later.
TEST_F(LeasedStreamTest, HeldMessagesOnAStreamRenewTheLeaseOfItsWriter) {
  while (get("world").objects() == 3) {
    request_.mutable_batch()->Clear();
    request_.mutable_batch()->set_continues(true);
    ASSERT_TRUE(send());
    ASSERT_TRUE(response_.ack().pending()) << response_.ShortDebugString();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));  // at most 4,095 messages may be held
  }
  EXPECT_EQ(get("world").objects(), 1u) << "the objects of writer 8 are gone";
  *request_.mutable_batch() = leased(insert_balls(4, 5), 7, 2, 0);
  ASSERT_TRUE(send());
  EXPECT_EQ(response_.ack().applied(), 2u) << response_.ShortDebugString();
  EXPECT_EQ(get("world").objects(), 3u);
  stream_->WritesDone();
  EXPECT_TRUE(stream_->Finish().ok());
}

TEST_F(LifetimesRpcTest, WrongLeasesAreRefused) {
  v1::UpdateBatch no_writer = insert_balls(1, 1);
  no_writer.set_lease_ms(1);
  expect_refused(apply(no_writer), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "lease_ms"});
  const v1::Error error = error_of(apply(leased(insert_balls(1, 1), 7, 1, limits::kMaxLeaseMs + 1)));
  expect_error(error, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "lease_ms"});
  EXPECT_EQ(error.limit(), "lease_ms");
  EXPECT_EQ(error.limit_value(), limits::kMaxLeaseMs);
  EXPECT_EQ(get("world").objects(), 0u);
  EXPECT_TRUE(apply(leased(insert_balls(1, 1), 7, 1, limits::kMaxLeaseMs)).ok());
}

class LifetimesKillTest : public ::testing::Test {
 protected:
  void upload_and_place(const std::string& mesh, const std::string& scene) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::UploadMeshResponse uploaded;
    const auto upload = daemon_.stubs().scenes->UploadMesh(&context, &uploaded);
    upload->Write(whole_mesh(mesh));
    upload->WritesDone();
    ASSERT_TRUE(upload->Finish().ok());
    grpc::ClientContext changing;
    set_timeout(changing);
    v1::ChangeInstancesResponse changed;
    ASSERT_TRUE(daemon_.stubs().scenes->ChangeInstances(&changing, place_one(mesh, 1, scene), &changed).ok());
  }
  void restart() {
    daemon_.kill();
    daemon_.start();
  }

  KeptDaemon daemon_;
};

// After each kill, the specifications are the same, an idle scene and an unused mesh still go, and what was deleted
// stays deleted.
TEST_F(LifetimesKillTest, LifetimesSurviveAKill) {
  daemon_.start();
  v1::SceneSpec lasting = idle_spec(limits::kMaxLifetimeSeconds);
  lasting.set_mesh_grace_s(1);
  create_scene(daemon_.stubs(), "lasting", lasting);
  upload_and_place("kept", "lasting");
  create_scene(daemon_.stubs(), "short", grace_spec());
  upload_and_place("unused", "short");
  {
    grpc::ClientContext context;
    set_timeout(context);
    v1::DeleteSceneRequest request;
    request.set_name("short");
    v1::DeleteSceneResponse deleted;
    ASSERT_TRUE(daemon_.stubs().scenes->DeleteScene(&context, request, &deleted).ok());
  }
  create_scene(daemon_.stubs(), "idle", idle_spec());
  restart();
  EXPECT_EQ(get_scene(daemon_.stubs(), "lasting").spec().idle_ttl_s(), limits::kMaxLifetimeSeconds);
  EXPECT_EQ(get_scene(daemon_.stubs(), "lasting").spec().mesh_grace_s(), 1u);
  wait_until_scene_is_gone(daemon_.stubs(), "idle");
  wait_until_mesh_is_gone(daemon_.stubs(), "unused");
  for (const char* const line : {"idle scene deleted", "unused mesh deleted"})  // written after the deletion
    while (!absl::StrContains(daemon_.log(), line)) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  restart();
  EXPECT_THAT(scene_names(daemon_.stubs()), ElementsAre("lasting"));
  EXPECT_THAT(mesh_names(daemon_.stubs()), ElementsAre("kept"));
  EXPECT_EQ(daemon_.stop(), 0) << daemon_.log();
  EXPECT_EQ(daemon_.maintain("check"), 0) << daemon_.printed();
}

// Writers with short leases insert groups of objects and fall silent, and the daemon is killed again and again, often
// while leases end. After each start, every group is there as a whole or not at all, a group that was seen to be gone
// stays gone, and the groups that are there go after the time of their leases.
TEST_F(LifetimesKillTest, NoKillLeavesHalfALease) {
  constexpr uint64_t kWriters = 6, kGroup = 50;
  std::mt19937 random(20261128);
  daemon_.start();
  create_scene(daemon_.stubs(), "world");
  const auto groups = [&] {
    std::map<uint64_t, uint64_t> sizes;
    for (const auto& [id, point] : points_of(daemon_.stubs(), "world")) ++sizes[id / kGroup];
    return sizes;
  };
  uint64_t group = 0;
  for (int kill = 0; kill < static_cast<int>(scaled_count(6)); ++kill) {
    SCOPED_TRACE("kill " + std::to_string(kill));
    std::set<uint64_t> sent;
    for (uint64_t writer = 1; writer <= kWriters; ++writer) {
      v1::ApplyUpdatesRequest request;
      request.set_scene("world");
      v1::UpdateBatch& batch = *request.mutable_batch();
      batch = leased({}, ++group, 1, static_cast<uint32_t>(10 + 20 * writer));
      sent.insert(group);
      v1::Insert& insert = *batch.add_inserts();
      insert.mutable_point();
      for (uint64_t i = 0; i < kGroup; ++i) {
        insert.add_ids(group * kGroup + i);
        for (int axis = 0; axis < 3; ++axis) insert.add_positions(static_cast<float>(i));
      }
      grpc::ClientContext context;
      set_timeout(context);
      v1::ApplyUpdatesResponse response;
      ASSERT_TRUE(daemon_.stubs().updates->ApplyUpdates(&context, request, &response).ok());
      EXPECT_EQ(response.ack().refused(), 0u);
    }
    std::map<uint64_t, uint64_t> before = groups();
    const uint64_t wanted = random() % kWriters;
    while (before.size() > wanted) before = groups();
    daemon_.kill();
    daemon_.start();
    for (const auto& [number, size] : groups()) {
      EXPECT_EQ(size, kGroup) << "half of group " << number;
      EXPECT_TRUE(before.contains(number)) << "group " << number << " has come back";
      EXPECT_TRUE(sent.contains(number));
    }
    while (!groups().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(daemon_.stop(), 0) << daemon_.log();
  daemon_.start();
  EXPECT_EQ(get_scene(daemon_.stubs(), "world").objects(), 0u);
  EXPECT_EQ(daemon_.stop(), 0) << daemon_.log();
  EXPECT_EQ(daemon_.maintain("check"), 0) << daemon_.printed();
}

}  // namespace
}  // namespace locus::test
