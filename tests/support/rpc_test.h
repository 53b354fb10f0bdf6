// Fixture for tests that call a server, with helpers for calls and matchers for refusals. Each test has a server of its
// own with an empty scene named world.
#ifndef LOCUS_TESTS_SUPPORT_RPC_TEST_H_
#define LOCUS_TESTS_SUPPORT_RPC_TEST_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/running_server.h"

namespace locus::test {

// Returns the Error in the details of `status`. If there is none, fails the test and returns an empty Error.
inline v1::Error error_of(const grpc::Status& status) {
  v1::Status details;
  v1::Error error;
  if (!details.ParseFromString(status.error_details()) || details.details_size() != 1 ||
      !details.details(0).UnpackTo(&error)) {
    ADD_FAILURE() << "no error details in " << status.error_code() << ": " << status.error_message();
    return error;
  }
  EXPECT_EQ(details.code(), status.error_code());
  EXPECT_EQ(details.message(), status.error_message());
  EXPECT_EQ(error.code(), status.error_code());
  return error;
}

// Expected content of a refusal.
struct Refused {
  grpc::StatusCode code;
  v1::Reason reason;
  std::string field;
  std::optional<uint32_t> index = std::nullopt;
};

inline void expect_error(const v1::Error& error, const Refused& expected) {
  EXPECT_EQ(error.code(), expected.code) << error.ShortDebugString();
  EXPECT_EQ(error.reason(), expected.reason) << error.ShortDebugString();
  EXPECT_EQ(error.field(), expected.field) << error.ShortDebugString();
  EXPECT_EQ(error.has_index(), expected.index.has_value()) << error.ShortDebugString();
  EXPECT_EQ(error.index(), expected.index.value_or(0)) << error.ShortDebugString();
  EXPECT_FALSE(error.message().empty());
}

inline void expect_refused(const grpc::Status& status, const Refused& expected) {
  ASSERT_FALSE(status.ok()) << "expected a refusal of " << expected.field;
  expect_error(error_of(status), expected);
}

template <class Repeated, class T>
void fill(Repeated* column, std::initializer_list<T> values) {
  column->Clear();
  for (const T value : values) column->Add(value);
}

// Cube from -1 to 1 on each axis: twelve triangles.
struct CubeMesh {
  std::vector<float> vertices = {-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1};
  std::vector<uint32_t> indices = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                   2, 3, 7, 2, 7, 6, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5};
};

// Returns the only message of an upload that consists of one message.
inline v1::UploadMeshRequest whole_mesh(const std::string& name, const CubeMesh& mesh = {}) {
  v1::UploadMeshRequest request;
  request.set_mesh(name);
  request.set_vertex_count(static_cast<uint32_t>(mesh.vertices.size() / 3));
  request.set_triangle_count(static_cast<uint32_t>(mesh.indices.size() / 3));
  request.mutable_vertices()->Add(mesh.vertices.begin(), mesh.vertices.end());
  request.mutable_indices()->Add(mesh.indices.begin(), mesh.indices.end());
  return request;
}

class RpcTest : public ::testing::Test {
 protected:
  explicit RpcTest(const server::ServerConfig& config = test_config()) : running_(config) {}

  void SetUp() override { ASSERT_TRUE(create("world").ok()); }

  Stubs& stubs() { return running_.stubs(); }

  // Makes a unary call of a stub's method, with the timeout kCallTimeout.
  template <class Stub, class Request, class Response>
  grpc::Status call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response* response) {
    grpc::ClientContext context;
    set_timeout(context);
    return (stub.*method)(&context, request, response);
  }

  grpc::Status create(const std::string& name, const v1::SceneSpec& spec = {}, v1::Scene* scene = nullptr,
                      bool if_absent = false) {
    v1::CreateSceneRequest request;
    request.set_name(name);
    *request.mutable_spec() = spec;
    request.set_if_absent(if_absent);
    v1::CreateSceneResponse response;
    const grpc::Status status = call(*stubs().scenes, &v1::SceneService::Stub::CreateScene, request, &response);
    if (scene != nullptr) *scene = response.scene();
    return status;
  }

  grpc::Status remove(const std::string& name) {
    v1::DeleteSceneRequest request;
    request.set_name(name);
    v1::DeleteSceneResponse response;
    return call(*stubs().scenes, &v1::SceneService::Stub::DeleteScene, request, &response);
  }

  v1::Scene get(const std::string& name) {
    v1::GetSceneRequest request;
    request.set_name(name);
    v1::GetSceneResponse response;
    EXPECT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::GetScene, request, &response).ok());
    return response.scene();
  }

  grpc::Status apply(const v1::UpdateBatch& batch, v1::UpdateAck* ack = nullptr, const std::string& scene = "world") {
    v1::ApplyUpdatesRequest request;
    request.set_scene(scene);
    *request.mutable_batch() = batch;
    v1::ApplyUpdatesResponse response;
    const grpc::Status status = call(*stubs().updates, &v1::UpdateService::Stub::ApplyUpdates, request, &response);
    if (ack != nullptr) *ack = response.ack();
    return status;
  }

  grpc::Status query(const v1::QueryBatch& batch, v1::QueryResult* result = nullptr,
                     const std::string& scene = "world") {
    v1::QueryRequest request;
    request.set_scene(scene);
    *request.mutable_batch() = batch;
    v1::QueryResponse response;
    const grpc::Status status = call(*stubs().queries, &v1::QueryService::Stub::Query, request, &response);
    if (result != nullptr) *result = response.result();
    return status;
  }

  // Uploads a mesh in the form of `messages`. Stops sending if the server ends the call early.
  grpc::Status upload(const std::vector<v1::UploadMeshRequest>& messages, v1::UploadMeshResponse* response = nullptr) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::UploadMeshResponse ignored;
    const auto writer = stubs().scenes->UploadMesh(&context, response != nullptr ? response : &ignored);
    for (const v1::UploadMeshRequest& message : messages)
      if (!writer->Write(message)) break;
    writer->WritesDone();
    return writer->Finish();
  }

  grpc::Status change(const v1::ChangeInstancesRequest& request, v1::ChangeInstancesResponse* response = nullptr) {
    v1::ChangeInstancesResponse ignored;
    return call(*stubs().scenes, &v1::SceneService::Stub::ChangeInstances, request,
                response != nullptr ? response : &ignored);
  }

  grpc::Status dump(const std::string& scene, std::vector<v1::DumpSceneResponse>* pieces, const v1::View& view = {}) {
    v1::DumpSceneRequest request;
    request.set_scene(scene);
    *request.mutable_view() = view;
    grpc::ClientContext context;
    set_timeout(context);
    const auto reader = stubs().scenes->DumpScene(&context, request);
    v1::DumpSceneResponse piece;
    while (reader->Read(&piece)) pieces->push_back(piece);
    return reader->Finish();
  }

  // Returns the complete dump of a scene, including its revision, as text for comparisons.
  std::string dump(const std::string& scene = "world") {
    std::vector<v1::DumpSceneResponse> pieces;
    const grpc::Status status = dump(scene, &pieces);
    EXPECT_TRUE(status.ok()) << status.error_message();
    std::string text;
    for (const v1::DumpSceneResponse& piece : pieces) text += piece.DebugString();
    return text;
  }

  RunningServer running_;
};

// Returns a batch that inserts balls of radius 1 with the ids `first_id` to `last_id`: the ball with id i is at (3 i,
// 0, 0).
inline v1::UpdateBatch insert_balls(uint64_t first_id, uint64_t last_id) {
  v1::UpdateBatch batch;
  v1::Insert* insert = batch.add_inserts();
  for (uint64_t id = first_id; id <= last_id; ++id) {
    insert->add_ids(id);
    insert->add_positions(3 * static_cast<float>(id));
    insert->add_positions(0);
    insert->add_positions(0);
  }
  insert->mutable_ball()->add_radii(1);
  return batch;
}

// Returns a batch with one ray from the origin in the direction +x.
inline v1::QueryBatch ray_along_x() {
  v1::QueryBatch batch;
  v1::Rays* rays = batch.add_blocks()->mutable_rays();
  fill(rays->mutable_origins(), {0.f, 0.f, 0.f});
  fill(rays->mutable_directions(), {1.f, 0.f, 0.f});
  return batch;
}

// Returns a change that places one instance of a mesh. If `id` is 0, the server chooses the id.
inline v1::ChangeInstancesRequest place_one(const std::string& mesh, uint64_t id, const std::string& scene = "world") {
  v1::ChangeInstancesRequest request;
  request.set_scene(scene);
  v1::Placement* place = request.add_place();
  place->set_mesh(mesh);
  if (id != 0) place->add_ids(id);
  fill(place->mutable_translations(), {10.0, 0.0, 0.0});
  return request;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RPC_TEST_H_
