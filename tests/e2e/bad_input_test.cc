#include <array>

#include "tests/support/random.h"
#include "tests/support/raw_call.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

constexpr std::array kMethods = {
    "/locus.v1.ServerService/GetServer",
    "/locus.v1.ServerService/GetQuotas",
    "/locus.v1.SceneService/CreateScene",
    "/locus.v1.SceneService/GetScene",
    "/locus.v1.SceneService/ListScenes",
    "/locus.v1.SceneService/DeleteScene",
    "/locus.v1.SceneService/UpdateScene",
    "/locus.v1.SceneService/UploadMesh",
    "/locus.v1.SceneService/ListMeshes",
    "/locus.v1.SceneService/DeleteMesh",
    "/locus.v1.SceneService/ChangeInstances",
    "/locus.v1.SceneService/DumpScene",
    "/locus.v1.UpdateService/ApplyUpdates",
    "/locus.v1.UpdateService/StreamUpdates",
    "/locus.v1.QueryService/Query",
    "/locus.v1.QueryService/StreamQueries",
    "/locus.v1.QueryService/Step",
};

// Deadline of a call, far above the time of any call that is answered. A call can wait for a revision that is never
// published; the deadline ends this call.
constexpr std::chrono::seconds kRequestTimeout{15};

class BadInputTest : public RpcTest {
 protected:
  void SetUp() override {
    RpcTest::SetUp();
    ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
    ASSERT_TRUE(change(place_one("cube", 100)).ok());
    ASSERT_TRUE(apply(insert_balls(1, 5)).ok());
  }

  // Sends a request. If it is refused, expects that the scene still equals `state`; if it is accepted, sets `state` to
  // the new scene.
  void send(const std::string& method, const std::string& bytes, std::string* state) {
    const RawReply reply = raw_call(stubs().channel, method, bytes, kRequestTimeout);
    if (reply.status.ok()) {
      settle(state);
      return;
    }
    EXPECT_NE(reply.status.error_code(), grpc::StatusCode::UNAVAILABLE) << method << " ended the server";
    EXPECT_NE(reply.status.error_code(), grpc::StatusCode::UNKNOWN) << method;
    EXPECT_EQ(dump(), *state) << method << ": " << reply.status.error_message();
  }

  // Waits until all changes of the scene are published, and sets `state` to a dump of the scene. Creates the scene
  // again if it was deleted.
  void settle(std::string* state) {
    ASSERT_TRUE(create("world", {}, nullptr, true).ok());
    while (get("world").pending_changes() > 0) {
    }
    *state = dump();
  }
};

std::string random_bytes(Random& random) {
  std::string bytes(random.below(200), '\0');
  for (char& byte : bytes) byte = static_cast<char>(random.next());
  return bytes;
}

std::string mutated(std::string bytes, Random& random) {
  const int changes = random.whole(1, 4);
  for (int i = 0; i < changes && !bytes.empty(); ++i) {
    const size_t place = random.below(bytes.size());
    switch (random.below(4)) {
      case 0:
        bytes[place] = static_cast<char>(random.next());
        break;
      case 1:
        bytes[place] = static_cast<char>(bytes[place] ^ (1 << random.below(8)));
        break;
      case 2:
        bytes.erase(place, random.below(8) + 1);
        break;
      default:
        bytes.insert(place, random.below(8) + 1, static_cast<char>(random.next()));
    }
  }
  return bytes;
}

// Returns a valid request for every method, to be mutated.
std::vector<std::pair<std::string, std::string>> valid_requests() {
  v1::ApplyUpdatesRequest apply;
  apply.set_scene("world");
  *apply.mutable_batch() = insert_balls(3, 9);
  apply.mutable_batch()->add_remove_ids(1);
  v1::Move* move = apply.mutable_batch()->add_moves();
  move->add_ids(2);
  fill(move->mutable_positions_f64(), {1.0, 2.0, 3.0});
  fill(move->mutable_rotations(), {0.f, 0.f, 0.f, 1.f});
  v1::StreamUpdatesRequest stream;
  stream.set_scene("world");
  *stream.mutable_batch() = apply.batch();
  v1::QueryRequest query;
  query.set_scene("world");
  *query.mutable_batch() = ray_along_x();
  query.mutable_batch()->mutable_view()->set_exactly(1);
  v1::Boxes* boxes = query.mutable_batch()->add_blocks()->mutable_boxes();
  fill(boxes->mutable_centers(), {3.f, 0.f, 0.f});
  fill(boxes->mutable_half_extents(), {2.f, 2.f, 2.f});
  query.mutable_batch()->add_blocks()->mutable_lookup()->add_groups(3);
  v1::StreamQueriesRequest query_stream;
  query_stream.set_scene("world");
  *query_stream.mutable_batch() = query.batch();
  v1::StepRequest step;
  step.set_scene("world");
  *step.mutable_update() = apply.batch();
  *step.mutable_queries() = query.batch();
  step.mutable_queries()->clear_view();
  v1::StreamQueriesRequest step_stream;
  step_stream.set_scene("world");
  *step_stream.mutable_update() = step.update();
  *step_stream.mutable_batch() = step.queries();
  v1::CreateSceneRequest create;
  create.set_name("other");
  (*create.mutable_spec()->mutable_labels())["a"] = "b";
  create.mutable_spec()->set_static_from("world");
  create.set_if_absent(true);
  v1::GetSceneRequest get;
  get.set_name("world");
  v1::DumpSceneRequest dump;
  dump.set_scene("world");
  return {{"/locus.v1.UpdateService/ApplyUpdates", apply.SerializeAsString()},
          {"/locus.v1.UpdateService/StreamUpdates", stream.SerializeAsString()},
          {"/locus.v1.QueryService/Query", query.SerializeAsString()},
          {"/locus.v1.QueryService/StreamQueries", query_stream.SerializeAsString()},
          {"/locus.v1.QueryService/StreamQueries", step_stream.SerializeAsString()},
          {"/locus.v1.QueryService/Step", step.SerializeAsString()},
          {"/locus.v1.SceneService/CreateScene", create.SerializeAsString()},
          {"/locus.v1.SceneService/GetScene", get.SerializeAsString()},
          {"/locus.v1.SceneService/DumpScene", dump.SerializeAsString()},
          {"/locus.v1.SceneService/UploadMesh", whole_mesh("cube").SerializeAsString()},
          {"/locus.v1.SceneService/ChangeInstances", place_one("cube", 7).SerializeAsString()}};
}

TEST_F(BadInputTest, RandomBytesAreRefusedByEveryMethodAndTheServerContinues) {
  constexpr uint64_t kSeed = 51;
  SCOPED_TRACE(kSeed);
  Random random(kSeed);
  std::string state = dump();
  for (int round = 0; round < 40; ++round)
    for (const char* method : kMethods) send(method, random_bytes(random), &state);
  EXPECT_EQ(get("world").name(), "world");
}

TEST_F(BadInputTest, MutatedRequestsAreAnsweredOrRefusedAndTheServerContinues) {
  constexpr uint64_t kSeed = 52;
  SCOPED_TRACE(kSeed);
  Random random(kSeed);
  std::string state = dump();
  const auto requests = valid_requests();
  for (int round = 0; round < 100; ++round)
    for (const auto& [method, bytes] : requests) send(method, mutated(bytes, random), &state);
  EXPECT_EQ(get("world").name(), "world");
}

TEST_F(BadInputTest, BytesThatAreNoMessageEndTheirStreamAsMalformed) {
  for (const char* method : {"/locus.v1.UpdateService/StreamUpdates", "/locus.v1.QueryService/StreamQueries"}) {
    const RawReply reply = raw_call(stubs().channel, method, "\xff\xff\xff\xff");
    expect_refused(reply.status, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, ""});
  }
}

TEST_F(BadInputTest, UnknownMethodsAreUnimplemented) {
  const RawReply reply = raw_call(stubs().channel, "/locus.v1.QueryService/NoSuchMethod", "");
  EXPECT_EQ(reply.status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
}

}  // namespace
}  // namespace locus::test
