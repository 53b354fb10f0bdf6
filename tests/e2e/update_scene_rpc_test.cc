// UpdateScene and the cell size of a scene: what is refused, that no answer changes, and durability.
#include <limits>

#include "tests/support/kept_daemon.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

v1::UpdateSceneRequest change_of(const std::vector<std::string>& fields, double cell_size = 0) {
  v1::UpdateSceneRequest request;
  request.set_name("world");
  for (const std::string& field : fields) request.add_fields(field);
  request.set_cell_size(cell_size);
  return request;
}

class UpdateSceneRpcTest : public RpcTest {
 protected:
  grpc::Status update(const v1::UpdateSceneRequest& request, v1::UpdateSceneResponse* response = nullptr) {
    v1::UpdateSceneResponse ignored;
    return call(*stubs().scenes, &v1::SceneService::Stub::UpdateScene, request,
                response != nullptr ? response : &ignored);
  }
};

TEST_F(UpdateSceneRpcTest, SettingsAreChangedWithoutARevision) {
  ASSERT_TRUE(apply(insert_balls(1, 3000)).ok());
  v1::QueryBatch batch = ray_along_x();
  batch.mutable_blocks(0)->mutable_rays()->set_mode(v1::RAY_MODE_ALL);
  v1::QueryResult before;
  ASSERT_TRUE(query(batch, &before).ok());
  v1::UpdateSceneRequest request = change_of({"cell_size", "labels"}, 100);
  (*request.mutable_labels())["map"] = "delta";
  v1::UpdateSceneResponse response;
  ASSERT_TRUE(update(request, &response).ok());
  EXPECT_EQ(response.cell_size(), 128) << "rounded up";
  EXPECT_EQ(response.labels().at("map"), "delta");
  const v1::Scene scene = get("world");
  EXPECT_EQ(scene.spec().cell_size(), 128);
  EXPECT_EQ(scene.spec().labels().at("map"), "delta");
  EXPECT_EQ(scene.revision(), before.revision());
  v1::QueryResult after;
  ASSERT_TRUE(query(batch, &after).ok());
  EXPECT_EQ(after.SerializeAsString(), before.SerializeAsString());
  ASSERT_TRUE(update(change_of({"labels"})).ok());
  EXPECT_THAT(get("world").spec().labels(), IsEmpty());
  EXPECT_EQ(get("world").spec().cell_size(), 128) << "a setting that is not named stays";
}

TEST_F(UpdateSceneRpcTest, ANewSceneMayHaveACellSize) {
  v1::SceneSpec spec;
  spec.set_cell_size(0.3);
  v1::Scene scene;
  ASSERT_TRUE(create("sized", spec, &scene).ok());
  EXPECT_EQ(scene.spec().cell_size(), 0.5);
}

TEST_F(UpdateSceneRpcTest, ListScenesFiltersByTheNewLabels) {
  v1::UpdateSceneRequest request = change_of({"labels"});
  (*request.mutable_labels())["map"] = "delta";
  ASSERT_TRUE(update(request).ok());
  v1::ListScenesRequest list;
  (*list.mutable_labels())["map"] = "delta";
  v1::ListScenesResponse listed;
  ASSERT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::ListScenes, list, &listed).ok());
  EXPECT_EQ(listed.scenes_size(), 1);
  (*list.mutable_labels())["map"] = "other";
  ASSERT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::ListScenes, list, &listed).ok());
  EXPECT_EQ(listed.scenes_size(), 0);
}

TEST_F(UpdateSceneRpcTest, WrongRequestsAreRefusedByNameAndChangeNothing) {
  const std::string before = get("world").SerializeAsString();
  constexpr auto kInvalid = grpc::StatusCode::INVALID_ARGUMENT;
  const auto refused = [&](const v1::UpdateSceneRequest& request, v1::Reason reason, const std::string& field,
                           std::optional<uint32_t> index = std::nullopt) {
    SCOPED_TRACE(request.ShortDebugString());
    expect_refused(update(request), {kInvalid, reason, field, index});
    EXPECT_EQ(get("world").SerializeAsString(), before);
  };
  refused(change_of({}), v1::REASON_MALFORMED, "fields");
  refused(change_of({"cell_size", "history_ticks"}, 4), v1::REASON_MALFORMED, "fields", 1);
  refused(change_of({"Cell_size"}), v1::REASON_MALFORMED, "fields", 0);
  refused(change_of({"labels"}, 4), v1::REASON_MALFORMED, "cell_size");
  v1::UpdateSceneRequest unnamed = change_of({"cell_size"}, 4);
  (*unnamed.mutable_labels())["map"] = "delta";
  refused(unnamed, v1::REASON_MALFORMED, "labels");
  v1::UpdateSceneRequest unknown = change_of({"cell_size"}, 4);
  unknown.GetReflection()->MutableUnknownFields(&unknown)->AddVarint(77, 1);
  refused(unknown, v1::REASON_MALFORMED, "field 77");
  v1::UpdateSceneRequest crowded = change_of({"labels"});
  for (int i = 0; i < 17; ++i) (*crowded.mutable_labels())[std::to_string(i)] = "";
  refused(crowded, v1::REASON_LIMIT, "labels");
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double size : {std::numeric_limits<double>::quiet_NaN(), infinity, -infinity}) {
    refused(change_of({"cell_size"}, size), v1::REASON_NOT_FINITE, "cell_size");
    v1::SceneSpec spec;
    spec.set_cell_size(size);
    expect_refused(create("other", spec), {kInvalid, v1::REASON_NOT_FINITE, "spec.cell_size"});
  }
  for (const double size : {-1.0, -0x1p-30, 1e300, 0x1p32, 0x1p-21}) {
    refused(change_of({"cell_size"}, size), v1::REASON_OUT_OF_RANGE, "cell_size");
    v1::SceneSpec spec;
    spec.set_cell_size(size);
    expect_refused(create("other", spec), {kInvalid, v1::REASON_OUT_OF_RANGE, "spec.cell_size"});
  }
  v1::UpdateSceneRequest nowhere = change_of({"cell_size"}, 4);
  nowhere.set_name("nowhere");
  expect_refused(update(nowhere), {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "scene"});
}

class SceneDescriptionRpcTest : public UpdateSceneRpcTest {
 protected:
  v1::SceneDescription description() {
    v1::GetSceneRequest request;
    request.set_name("world");
    v1::GetSceneResponse response;
    EXPECT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::GetScene, request, &response).ok());
    return response.description();
  }
};

TEST_F(SceneDescriptionRpcTest, StructuresAreDescribed) {
  EXPECT_EQ(description().statics().kind(), v1::STRUCTURE_KIND_BVH);
  EXPECT_EQ(description().objects().kind(), v1::STRUCTURE_KIND_HASH_GRID);
  EXPECT_EQ(description().statics().nodes(), 0u);
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  ASSERT_TRUE(change(place_one("cube", 100)).ok());
  ASSERT_TRUE(apply(insert_balls(1000, 3999)).ok());
  const v1::SceneDescription found = description();
  EXPECT_EQ(found.statics().values(), 1u);
  EXPECT_GE(found.statics().nodes(), 1u);
  EXPECT_GE(found.statics().levels(), 1u);
  EXPECT_GT(found.statics().bytes(), 12 * sizeof(float) * 9);
  EXPECT_EQ(found.objects().values(), 3000u);
  EXPECT_GT(found.objects().bricks(), 10u);
  EXPECT_GE(found.objects().levels(), 1u);
  EXPECT_GT(found.objects().cell_size(), 0);
  EXPECT_GT(found.objects().bytes(), 3000 * sizeof(double) * 3);
  ASSERT_TRUE(update(change_of({"cell_size"}, 256)).ok());
  EXPECT_EQ(description().objects().cell_size(), 256);
}

TEST_F(SceneDescriptionRpcTest, CostsOfQueriesAreLearned) {
  ASSERT_TRUE(apply(insert_balls(1, 300)).ok());
  EXPECT_EQ(description().costs_size(), 0);
  v1::QueryBatch batch = ray_along_x();
  ASSERT_TRUE(query(batch).ok());
  batch.set_by_list(true);
  ASSERT_TRUE(query(batch).ok());
  const v1::SceneDescription found = description();
  ASSERT_EQ(found.costs_size(), 2) << found.ShortDebugString();
  for (const v1::LearnedCost& cost : found.costs()) {
    EXPECT_EQ(cost.kind(), "rays_first");
    EXPECT_EQ(cost.source(), v1::SOURCE_BOTH);
    EXPECT_GT(cost.nanoseconds(), 0);
  }
  EXPECT_FALSE(found.costs(0).by_list());
  EXPECT_LT(found.costs(0).work(), 300);
  EXPECT_TRUE(found.costs(1).by_list());
  EXPECT_NEAR(found.costs(1).work(), 300, 2) << "every object is tested";
}

TEST(UpdateSceneRestartTest, SettingsSurviveARestart) {
  KeptDaemon daemon;
  daemon.start();
  create_scene(daemon.stubs(), "world");
  v1::UpdateSceneRequest request = change_of({"cell_size", "labels"}, 16);
  (*request.mutable_labels())["map"] = "delta";
  v1::UpdateSceneResponse response;
  grpc::ClientContext context;
  set_timeout(context);
  ASSERT_TRUE(daemon.stubs().scenes->UpdateScene(&context, request, &response).ok());
  daemon.kill();
  daemon.start();
  const v1::Scene scene = get_scene(daemon.stubs(), "world");
  EXPECT_EQ(scene.spec().cell_size(), 16);
  EXPECT_THAT(scene.spec().labels(), ElementsAre(Pair("map", "delta")));
  EXPECT_EQ(daemon.stop(), 0);
}

}  // namespace
}  // namespace locus::test
