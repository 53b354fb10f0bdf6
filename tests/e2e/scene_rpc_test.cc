#include "core/base/limits.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;

class SceneRpcTest : public RpcTest {
 protected:
  grpc::Status list(const v1::ListScenesRequest& request, v1::ListScenesResponse* response) {
    return call(*stubs().scenes, &v1::SceneService::Stub::ListScenes, request, response);
  }

  static std::vector<std::string> names_of(const v1::ListScenesResponse& response) {
    std::vector<std::string> names;
    for (const v1::Scene& scene : response.scenes()) names.push_back(scene.name());
    return names;
  }
};

TEST_F(SceneRpcTest, ANewSceneIsReadyAndEmpty) {
  v1::SceneSpec spec;
  (*spec.mutable_labels())["level"] = "dm17";
  spec.set_winding(v1::WINDING_CLOCKWISE);
  v1::Scene scene;
  ASSERT_TRUE(create("arena", spec, &scene).ok());
  EXPECT_EQ(scene.name(), "arena");
  EXPECT_EQ(scene.state(), v1::SCENE_STATE_READY);
  EXPECT_NE(scene.epoch(), 0u);
  EXPECT_EQ(scene.revision(), 0u);
  EXPECT_EQ(scene.objects(), 0u);
  EXPECT_FALSE(scene.has_min());
  EXPECT_EQ(scene.spec().winding(), v1::WINDING_CLOCKWISE);
  EXPECT_EQ(scene.spec().durability(), v1::DURABILITY_MEMORY);
  EXPECT_EQ(scene.spec().labels().at("level"), "dm17");
  EXPECT_EQ(get("arena").SerializeAsString(), scene.SerializeAsString());
}

TEST_F(SceneRpcTest, ASceneDescribesWhatIsInIt) {
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  ASSERT_TRUE(change(place_one("cube", 100)).ok());
  v1::UpdateBatch batch = insert_balls(1, 2);
  batch.set_tick(7);
  ASSERT_TRUE(apply(batch).ok());
  const v1::Scene scene = get("world");
  EXPECT_EQ(scene.revision(), 2u);
  EXPECT_EQ(scene.tick(), 7u);
  EXPECT_EQ(scene.oldest_tick(), 7u);
  EXPECT_EQ(scene.objects(), 2u);
  EXPECT_EQ(scene.instances(), 1u);
  EXPECT_EQ(scene.triangles(), 12u);
  EXPECT_GT(scene.memory_bytes(), 0u);
  EXPECT_GT(scene.mesh_bytes(), 0u);
  EXPECT_NEAR(scene.min().x(), 2, 0.01);
  EXPECT_NEAR(scene.max().x(), 11, 0.01);
}

TEST_F(SceneRpcTest, ANameInUseIsRefusedUnlessIfAbsentIsSet) {
  v1::Scene first;
  v1::Scene second;
  ASSERT_TRUE(create("arena", {}, &first).ok());
  expect_refused(create("arena"), {grpc::StatusCode::ALREADY_EXISTS, v1::REASON_ALREADY_EXISTS, "name"});
  ASSERT_TRUE(create("arena", {}, &second, true).ok());
  EXPECT_EQ(first.epoch(), second.epoch());
}

TEST_F(SceneRpcTest, NamesOutsideThePatternAreRefusedEverywhere) {
  for (const std::string& name : {std::string(), std::string("Arena"), std::string("1st"), std::string("a-"),
                                  std::string("a b"), std::string(64, 'a'), std::string(1 << 20, 'x')}) {
    expect_refused(create(name), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "name"});
    expect_refused(remove(name), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "name"});
    expect_refused(apply({}, nullptr, name), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "scene"});
    expect_refused(query({}, nullptr, name), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "scene"});
  }
}

TEST_F(SceneRpcTest, AnUnknownSceneIsNotFoundEverywhere) {
  std::vector<v1::DumpSceneResponse> pieces;
  v1::GetSceneResponse scene;
  v1::GetSceneRequest get_request;
  get_request.set_name("nowhere");
  const std::vector<grpc::Status> statuses = {
      call(*stubs().scenes, &v1::SceneService::Stub::GetScene, get_request, &scene),
      remove("nowhere"),
      apply({}, nullptr, "nowhere"),
      query({}, nullptr, "nowhere"),
      dump("nowhere", &pieces),
      change(place_one("cube", 1, "nowhere")),
  };
  for (const grpc::Status& status : statuses) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
    EXPECT_EQ(error_of(status).reason(), v1::REASON_NOT_FOUND);
  }
}

TEST_F(SceneRpcTest, FieldsOfTheSpecThatAreNotServedAreNamed) {
  const auto refused = [this](const std::string& field, const v1::SceneSpec& spec) {
    expect_refused(create("arena", spec), {grpc::StatusCode::UNIMPLEMENTED, v1::REASON_NOT_SERVED, field});
  };
  v1::SceneSpec spec;
  spec.set_durability(v1::DURABILITY_LOCAL);
  refused("spec.durability", spec);
}

TEST_F(SceneRpcTest, UnknownEnumNumbersAndLongLabelsOfTheSpecAreRefused) {
  v1::SceneSpec spec;
  spec.set_winding(static_cast<v1::Winding>(9));
  expect_refused(create("arena", spec), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "spec.winding"});
  spec.Clear();
  spec.set_durability(static_cast<v1::Durability>(-1));
  expect_refused(create("arena", spec), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "spec.durability"});
  spec.Clear();
  spec.set_overload(static_cast<v1::OverloadPolicy>(3));
  expect_refused(create("arena", spec), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "spec.overload"});
  spec.Clear();
  for (uint32_t i = 0; i <= limits::kMaxLabels; ++i) (*spec.mutable_labels())[std::to_string(i)] = "";
  const v1::Error error = error_of(create("arena", spec));
  expect_error(error, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "spec.labels"});
  EXPECT_EQ(error.limit(), "labels");
  EXPECT_EQ(error.limit_value(), limits::kMaxLabels);
  EXPECT_EQ(error.asked(), limits::kMaxLabels + 1);
  spec.Clear();
  (*spec.mutable_labels())["key"] = std::string(limits::kMaxLabelLength + 1, 'x');
  EXPECT_EQ(error_of(create("arena", spec)).limit(), "label_length");
}

TEST_F(SceneRpcTest, TheOverloadPolicyIsWhatTheSceneWasCreatedWith) {
  v1::Scene scene;
  ASSERT_TRUE(create("usual", {}, &scene).ok());
  EXPECT_EQ(scene.spec().overload(), v1::OVERLOAD_POLICY_EVERY_BATCH);
  v1::SceneSpec spec;
  spec.set_overload(v1::OVERLOAD_POLICY_LATEST_WINS);
  ASSERT_TRUE(create("crowded", spec, &scene).ok());
  EXPECT_EQ(scene.spec().overload(), v1::OVERLOAD_POLICY_LATEST_WINS);
  EXPECT_EQ(scene.joined_updates(), 0u);
}

TEST_F(SceneRpcTest, StaticsCopiedFromAnotherSceneChangeIndependently) {
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  ASSERT_TRUE(change(place_one("cube", 100)).ok());
  v1::SceneSpec spec;
  spec.set_static_from("world");
  v1::Scene copy;
  ASSERT_TRUE(create("copy", spec, &copy).ok());
  EXPECT_EQ(copy.instances(), 1u);
  v1::ChangeInstancesRequest removal;
  removal.set_scene("world");
  removal.add_remove_ids(100);
  ASSERT_TRUE(change(removal).ok());
  EXPECT_EQ(get("world").instances(), 0u);
  EXPECT_EQ(get("copy").instances(), 1u);
  spec.set_static_from("nowhere");
  expect_refused(create("other", spec), {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "spec.static_from"});
}

TEST_F(SceneRpcTest, PagesHoldEverySceneOnceInOrder) {
  for (const char* name : {"c", "a", "b", "e", "d"}) ASSERT_TRUE(create(name).ok());
  std::vector<std::string> names;
  v1::ListScenesRequest request;
  request.set_page_size(2);
  do {
    v1::ListScenesResponse response;
    ASSERT_TRUE(list(request, &response).ok());
    ASSERT_LE(response.scenes_size(), 2);
    for (const v1::Scene& scene : response.scenes()) names.push_back(scene.name());
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_THAT(names, ElementsAre("a", "b", "c", "d", "e", "world"));
}

TEST_F(SceneRpcTest, LabelsFilterPages) {
  for (const char* name : {"a", "b", "c", "d"}) {
    v1::SceneSpec spec;
    (*spec.mutable_labels())["kind"] = name < std::string("c") ? "low" : "high";
    ASSERT_TRUE(create(name, spec).ok());
  }
  v1::ListScenesRequest request;
  (*request.mutable_labels())["kind"] = "high";
  v1::ListScenesResponse response;
  ASSERT_TRUE(list(request, &response).ok());
  EXPECT_THAT(names_of(response), ElementsAre("c", "d"));
  EXPECT_TRUE(response.next_page_token().empty());
  request.set_page_size(1);
  response.Clear();
  ASSERT_TRUE(list(request, &response).ok());
  EXPECT_THAT(names_of(response), ElementsAre("c"));
  request.set_page_token(response.next_page_token());
  response.Clear();
  ASSERT_TRUE(list(request, &response).ok());
  EXPECT_THAT(names_of(response), ElementsAre("d"));
  EXPECT_TRUE(response.next_page_token().empty());
}

TEST_F(SceneRpcTest, PagesThatAreTooLargeAndForeignTokensAreRefused) {
  v1::ListScenesRequest request;
  v1::ListScenesResponse response;
  request.set_page_size(limits::kMaxPageSize + 1);
  expect_refused(list(request, &response), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "page_size"});
  request.set_page_size(0);
  request.set_page_token("NOT A TOKEN");
  expect_refused(list(request, &response), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "page_token"});
}

TEST_F(SceneRpcTest, DeletingTwiceNeedsIfPresent) {
  EXPECT_TRUE(remove("world").ok());
  expect_refused(remove("world"), {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "scene"});
  v1::DeleteSceneRequest request;
  request.set_name("world");
  request.set_if_present(true);
  v1::DeleteSceneResponse response;
  EXPECT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::DeleteScene, request, &response).ok());
}

TEST_F(SceneRpcTest, MetadataThatNamesAnotherSceneIsRefused) {
  for (const std::string name : {"world", "other"}) {
    grpc::ClientContext context;
    set_timeout(context);
    context.AddMetadata("x-scene", name);
    v1::QueryRequest request;
    request.set_scene("world");
    v1::QueryResponse response;
    const grpc::Status status = stubs().queries->Query(&context, request, &response);
    if (name == "world")
      EXPECT_TRUE(status.ok()) << status.error_message();
    else
      expect_refused(status, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "x-scene"});
  }
}

class FullServerTest : public RpcTest {
 protected:
  FullServerTest()
      : RpcTest([] {
          server::ServerConfig config = test_config();
          config.max_scenes = 2;
          config.max_meshes = 1;
          config.max_streams = 1;
          config.max_calls = 1;
          config.max_receive_bytes = 1 << 16;
          return config;
        }()) {}
};

TEST_F(FullServerTest, ScenesAndMeshesBeyondTheLimitAreRefusedNamingIt) {
  ASSERT_TRUE(create("second").ok());
  v1::Error error = error_of(create("third"));
  expect_error(error, {grpc::StatusCode::RESOURCE_EXHAUSTED, v1::REASON_LIMIT, "name"});
  EXPECT_EQ(error.limit(), "scenes");
  EXPECT_EQ(error.limit_value(), 2);
  EXPECT_EQ(error.asked(), 3);
  EXPECT_TRUE(create("second", {}, nullptr, true).ok());
  ASSERT_TRUE(remove("second").ok());
  EXPECT_TRUE(create("third").ok());
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  error = error_of(upload({whole_mesh("second-cube")}));
  expect_error(error, {grpc::StatusCode::RESOURCE_EXHAUSTED, v1::REASON_LIMIT, "mesh"});
  EXPECT_EQ(error.limit(), "meshes");
}

TEST_F(FullServerTest, CallsBeyondTheLimitAreRefusedAndMayBeRetried) {
  grpc::ClientContext context;
  set_timeout(context);
  v1::UploadMeshResponse uploaded;
  const auto first = stubs().scenes->UploadMesh(&context, &uploaded);
  ASSERT_TRUE(first->Write(whole_mesh("cube")));
  grpc::Status status;
  // Repeats the call: it is admitted until the server has begun the upload, and then refused.
  do status = create("second", {}, nullptr, true);
  while (status.ok());
  const v1::Error error = error_of(status);
  expect_error(error, {grpc::StatusCode::RESOURCE_EXHAUSTED, v1::REASON_LIMIT, ""});
  EXPECT_EQ(error.limit(), "calls");
  EXPECT_GT(error.retry_after_ms(), 0u);
  first->WritesDone();
  EXPECT_TRUE(first->Finish().ok());
  EXPECT_TRUE(create("second", {}, nullptr, true).ok());
}

TEST_F(FullServerTest, StreamsBeyondTheLimitAreRefusedAndOpenOnesContinue) {
  v1::StreamUpdatesRequest request;
  request.set_scene("world");
  v1::StreamUpdatesResponse response;
  grpc::ClientContext first_context;
  set_timeout(first_context);
  const auto first = stubs().updates->StreamUpdates(&first_context);
  ASSERT_TRUE(first->Write(request));
  ASSERT_TRUE(first->Read(&response));
  grpc::ClientContext second_context;
  set_timeout(second_context);
  const auto second = stubs().updates->StreamUpdates(&second_context);
  EXPECT_FALSE(second->Read(&response));
  const v1::Error error = error_of(second->Finish());
  expect_error(error, {grpc::StatusCode::RESOURCE_EXHAUSTED, v1::REASON_LIMIT, ""});
  EXPECT_EQ(error.limit(), "streams");
  EXPECT_GT(error.retry_after_ms(), 0u);
  ASSERT_TRUE(first->Write(request));
  ASSERT_TRUE(first->Read(&response));
  first->WritesDone();
  EXPECT_TRUE(first->Finish().ok());
}

TEST_F(FullServerTest, AMessageThatIsTooLargeIsRefusedAndChangesNothing) {
  ASSERT_TRUE(apply(insert_balls(1, 2)).ok());
  const std::string before = dump();
  EXPECT_EQ(apply(insert_balls(100, 10000)).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  grpc::ClientContext context;
  set_timeout(context);
  const auto stream = stubs().updates->StreamUpdates(&context);
  v1::StreamUpdatesRequest request;
  request.set_scene("world");
  *request.mutable_batch() = insert_balls(100, 10000);
  stream->Write(request);
  v1::StreamUpdatesResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(dump(), before);
}

}  // namespace
}  // namespace locus::test
