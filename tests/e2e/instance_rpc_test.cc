#include <cmath>
#include <limits>
#include <thread>

#include "core/base/ids.h"
#include "tests/support/kept_daemon.h"
#include "tests/support/memory_log.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

class InstanceRpcTest : public RpcTest {
 protected:
  void SetUp() override {
    RpcTest::SetUp();
    ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  }

  // Expects the change to be refused as `expected` describes, and the scene to be unchanged.
  void expect_change_refused(const v1::ChangeInstancesRequest& request, const Refused& expected) {
    const std::string before = dump();
    expect_refused(change(request), expected);
    EXPECT_EQ(dump(), before);
  }

  v1::Scene get_when_settled() {
    v1::Scene scene = get("world");
    while (scene.pending_changes() > 0) scene = get("world");
    return scene;
  }
};

TEST_F(InstanceRpcTest, PlacedInstancesAreHitAndRemovedOnesAreNot) {
  v1::ChangeInstancesResponse response;
  ASSERT_TRUE(change(place_one("cube", 100), &response).ok());
  EXPECT_THAT(response.ids(), ::testing::ElementsAre(100u));
  EXPECT_EQ(response.change(), 1u);
  EXPECT_EQ(response.revision(), 1u);
  EXPECT_EQ(response.epoch(), get("world").epoch());
  v1::QueryResult result;
  ASSERT_TRUE(query(ray_along_x(), &result).ok());
  EXPECT_THAT(result.blocks(0).t(), ::testing::ElementsAre(9.f));
  EXPECT_THAT(result.blocks(0).ids(), ::testing::ElementsAre(100u));
  v1::ChangeInstancesRequest removal;
  removal.set_scene("world");
  removal.add_remove_ids(100);
  ASSERT_TRUE(change(removal, &response).ok());
  EXPECT_EQ(response.change(), 2u);
  ASSERT_TRUE(query(ray_along_x(), &result).ok());
  EXPECT_TRUE(std::isinf(result.blocks(0).t(0)));
}

TEST_F(InstanceRpcTest, ReplacingAnInstanceIsOneRevision) {
  ASSERT_TRUE(change(place_one("cube", 100)).ok());
  v1::ChangeInstancesRequest replacement = place_one("cube", 100);
  replacement.add_remove_ids(100);
  fill(replacement.mutable_place(0)->mutable_translations(), {20.0, 0.0, 0.0});
  v1::ChangeInstancesResponse response;
  ASSERT_TRUE(change(replacement, &response).ok());
  EXPECT_EQ(response.revision(), 2u);
  v1::QueryResult result;
  ASSERT_TRUE(query(ray_along_x(), &result).ok());
  EXPECT_THAT(result.blocks(0).t(), ::testing::ElementsAre(19.f));
}

TEST_F(InstanceRpcTest, GroupsAreRemovedWhole) {
  v1::ChangeInstancesRequest request = place_one("cube", 0);
  v1::Placement* place = request.mutable_place(0);
  fill(place->mutable_ids(), {uint64_t{1}, uint64_t{2}, uint64_t{3}});
  fill(place->mutable_translations(), {0., 0., 0., 5., 0., 0., 9., 0., 0.});
  fill(place->mutable_groups(), {uint64_t{7}, uint64_t{8}, uint64_t{7}});
  ASSERT_TRUE(change(request).ok());
  v1::ChangeInstancesRequest removal;
  removal.set_scene("world");
  removal.add_remove_groups(7);
  removal.add_remove_groups(12345);
  ASSERT_TRUE(change(removal).ok());
  EXPECT_EQ(get("world").instances(), 1u);
  removal.clear_remove_groups();
  removal.add_remove_groups(0);
  expect_change_refused(removal, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_OUT_OF_RANGE, "remove_groups", 0});
}

TEST_F(InstanceRpcTest, ChosenIdsAreReturnedAndSmall) {
  uint64_t last = kFirstChosenId - 1;
  for (const bool no_wait : {false, true}) {
    v1::ChangeInstancesRequest request = place_one("cube", 0);
    fill(request.mutable_place(0)->mutable_translations(), {0., 0., 0., 5., 0., 0.});
    request.set_no_wait(no_wait);
    v1::ChangeInstancesResponse response;
    ASSERT_TRUE(change(request, &response).ok());
    ASSERT_EQ(response.ids_size(), 2);
    EXPECT_NE(response.ids(0), response.ids(1));
    get_when_settled();
    v1::QueryBatch batch;
    for (const uint64_t id : response.ids()) {
      EXPECT_EQ(id, ++last);
      batch.mutable_blocks()->Clear();
      batch.add_blocks()->mutable_lookup()->add_ids(id);
      v1::QueryResult result;
      ASSERT_TRUE(query(batch, &result).ok());
      EXPECT_EQ(result.blocks(0).ids(0), id);
    }
  }
}

TEST_F(InstanceRpcTest, WithNoWaitTheReplyHasANumberAndTheChangeIsPublishedLater) {
  v1::ChangeInstancesRequest request = place_one("cube", 100);
  request.set_no_wait(true);
  v1::ChangeInstancesResponse response;
  ASSERT_TRUE(change(request, &response).ok());
  EXPECT_EQ(response.change(), 1u);
  EXPECT_FALSE(response.has_revision());
  EXPECT_THAT(response.ids(), ::testing::ElementsAre(100u));
  const v1::Scene scene = get_when_settled();
  EXPECT_EQ(scene.state(), v1::SCENE_STATE_READY);
  EXPECT_EQ(scene.instances(), 1u);
  EXPECT_EQ(scene.last_build_error(), "");
}

// The first change waits for the log, and the second one waits for the first.
TEST_F(InstanceRpcTest, AMeshOfAChangeThatWaitsForAnotherIsInUse) {
  MemoryLog log;
  RunningServer durable(test_config(), &log);
  v1::SceneSpec spec;
  spec.set_durability(v1::DURABILITY_LOCAL);
  create_scene(durable.stubs(), "world", spec);
  for (const char* const mesh : {"first", "second"}) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::UploadMeshResponse uploaded;
    const auto upload = durable.stubs().scenes->UploadMesh(&context, &uploaded);
    upload->Write(whole_mesh(mesh));
    upload->WritesDone();
    ASSERT_TRUE(upload->Finish().ok());
  }
  const auto place = [&](const std::string& mesh, uint64_t id) {
    v1::ChangeInstancesRequest request = place_one(mesh, id);
    request.set_no_wait(true);
    v1::ChangeInstancesResponse response;
    return call(*durable.stubs().scenes, &v1::SceneService::Stub::ChangeInstances, request, &response);
  };
  const auto delete_mesh = [&](const std::string& mesh) {
    v1::DeleteMeshRequest request;
    request.set_mesh(mesh);
    v1::DeleteMeshResponse response;
    return call(*durable.stubs().scenes, &v1::SceneService::Stub::DeleteMesh, request, &response);
  };
  log.hold();
  ASSERT_TRUE(place("first", 1).ok());
  log.wait_for_writer();
  ASSERT_TRUE(place("second", 2).ok());
  expect_refused(delete_mesh("second"), {grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_IN_USE, "mesh"});
  log.release();
  while (get_scene(durable.stubs(), "world").instances() < 2) std::this_thread::yield();
  v1::ChangeInstancesRequest removal;
  removal.set_scene("world");
  removal.add_remove_ids(2);
  v1::ChangeInstancesResponse removed;
  ASSERT_TRUE(call(*durable.stubs().scenes, &v1::SceneService::Stub::ChangeInstances, removal, &removed).ok());
  EXPECT_TRUE(delete_mesh("second").ok()) << "nothing waits any more";
}

TEST_F(InstanceRpcTest, AFailedBackgroundChangeIsReportedByTheScene) {
  v1::ChangeInstancesRequest request;
  request.set_scene("world");
  request.add_remove_ids(12345);
  request.set_no_wait(true);
  ASSERT_TRUE(change(request).ok());
  EXPECT_THAT(get_when_settled().last_build_error(), ::testing::HasSubstr("12345"));
  // last_build_error is the error of the latest failed change, so a change that succeeds does not clear it.
  ASSERT_TRUE(change(place_one("cube", 1)).ok());
  EXPECT_THAT(get("world").last_build_error(), ::testing::HasSubstr("12345"));
}

TEST_F(InstanceRpcTest, WithNoWaitWrongValuesAreStillRefused) {
  v1::ChangeInstancesRequest request = place_one("cube", 1);
  request.set_no_wait(true);
  request.mutable_place(0)->add_scales(-1);
  expect_change_refused(request, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_OUT_OF_RANGE, "place[0].scales", 0});
}

TEST_F(InstanceRpcTest, ConcurrentChangesAreAllPublished) {
  constexpr uint64_t kCallers = 4;
  constexpr uint64_t kChanges = 10;
  std::vector<std::thread> callers;
  for (uint64_t caller = 0; caller < kCallers; ++caller)
    callers.emplace_back([this, caller] {
      for (uint64_t i = 0; i < kChanges; ++i) EXPECT_TRUE(change(place_one("cube", 1 + caller * kChanges + i)).ok());
    });
  for (std::thread& caller : callers) caller.join();
  const v1::Scene scene = get("world");
  EXPECT_EQ(scene.instances(), kCallers * kChanges);
  EXPECT_EQ(scene.revision(), kCallers * kChanges);
}

TEST_F(InstanceRpcTest, UnknownMeshesAndIdsAreNamed) {
  expect_change_refused(place_one("nothing", 1), {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "place[0].mesh"});
  expect_change_refused(place_one("", 1), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "place[0].mesh"});
  v1::ChangeInstancesRequest removal;
  removal.set_scene("world");
  removal.add_remove_ids(5);
  expect_change_refused(removal, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_UNKNOWN_ID, "remove_ids", 0});
}

TEST_F(InstanceRpcTest, IdsThatAreTakenByObjectsInstancesOrTwiceAreNamed) {
  const Refused taken{grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_DUPLICATE_ID, "place[0].ids", 0};
  ASSERT_TRUE(apply(insert_balls(1, 1)).ok());
  expect_change_refused(place_one("cube", 1), taken);
  ASSERT_TRUE(change(place_one("cube", 100)).ok());
  expect_change_refused(place_one("cube", 100), taken);
  v1::ChangeInstancesRequest twice = place_one("cube", 5);
  twice.mutable_place(0)->add_ids(5);
  fill(twice.mutable_place(0)->mutable_translations(), {0., 0., 0., 5., 0., 0.});
  expect_change_refused(twice, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_DUPLICATE_ID, "place[0].ids", 1});
  v1::ChangeInstancesRequest zero = place_one("cube", 5);
  zero.mutable_place(0)->set_ids(0, 0);
  expect_change_refused(zero, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_OUT_OF_RANGE, "place[0].ids", 0});
}

TEST_F(InstanceRpcTest, OneTranslationServesAllIds) {
  v1::ChangeInstancesRequest request = place_one("cube", 1);
  request.mutable_place(0)->add_ids(2);
  v1::ChangeInstancesResponse response;
  ASSERT_TRUE(change(request, &response).ok());
  EXPECT_THAT(response.ids(), ::testing::ElementsAre(1u, 2u));
}

TEST_F(InstanceRpcTest, WrongColumnsAndValuesOfAPlacementAreNamed) {
  const auto refused = [this](const std::string& field, v1::Reason reason, std::optional<uint32_t> index,
                              const std::function<void(v1::Placement*)>& spoil) {
    v1::ChangeInstancesRequest request = place_one("cube", 1);
    spoil(request.mutable_place(0));
    expect_change_refused(request, {grpc::StatusCode::INVALID_ARGUMENT, reason, "place[0]." + field, index});
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  refused("translations", v1::REASON_NOT_FINITE, 0, [&](auto* place) { place->set_translations(1, nan); });
  refused("translations", v1::REASON_OUT_OF_RANGE, 0, [&](auto* place) { place->set_translations(1, 2e9); });
  refused("translations", v1::REASON_COLUMN_LENGTH, {}, [&](auto* place) { place->add_translations(1); });
  refused("translations", v1::REASON_COLUMN_LENGTH, {}, [&](auto* place) { place->clear_translations(); });
  refused("rotations", v1::REASON_COLUMN_LENGTH, {}, [&](auto* place) { place->add_rotations(1); });
  refused("rotations", v1::REASON_OUT_OF_RANGE, 0, [&](auto* place) {
    fill(place->mutable_rotations(), {0.f, 0.f, 0.f, 2.f});
  });
  refused("rotations", v1::REASON_NOT_FINITE, 0, [&](auto* place) {
    fill(place->mutable_rotations(), {0.f, 0.f, 0.f, infinity});
  });
  refused("scales", v1::REASON_OUT_OF_RANGE, 0, [&](auto* place) { place->add_scales(0); });
  refused("scales", v1::REASON_NOT_FINITE, 0, [&](auto* place) { place->add_scales(infinity); });
  refused("layers", v1::REASON_COLUMN_LENGTH, {}, [&](auto* place) { fill(place->mutable_layers(), {1u, 2u}); });
  refused("groups", v1::REASON_COLUMN_LENGTH, {}, [&](auto* place) {
    fill(place->mutable_groups(), {uint64_t{1}, uint64_t{2}});
  });
  refused("tags", v1::REASON_COLUMN_LENGTH, {}, [&](auto* place) {
    fill(place->mutable_tags(), {uint64_t{1}, uint64_t{2}});
  });
}

TEST_F(InstanceRpcTest, DumpsUseTheCurrentNamesOfMeshes) {
  // The mesh's first name is deleted before the mesh is placed under another name.
  ASSERT_TRUE(upload({whole_mesh("alias")}).ok());
  v1::DeleteMeshRequest request;
  request.set_mesh("cube");
  v1::DeleteMeshResponse response;
  ASSERT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::DeleteMesh, request, &response).ok());
  ASSERT_TRUE(change(place_one("alias", 1)).ok());
  std::vector<v1::DumpSceneResponse> pieces;
  ASSERT_TRUE(RpcTest::dump("world", &pieces).ok());
  ASSERT_EQ(pieces.size(), 1u);
  ASSERT_EQ(pieces[0].instances_size(), 1);
  EXPECT_EQ(pieces[0].instances(0).mesh(), "alias");
}

}  // namespace
}  // namespace locus::test
