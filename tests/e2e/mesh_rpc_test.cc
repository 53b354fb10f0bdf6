#include <cmath>
#include <limits>

#include "client/lib/client.h"
#include "core/base/limits.h"
#include "server/services/sha256.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

std::string hash_of(const CubeMesh& mesh) {
  const Sha256 hash = server::mesh_hash(mesh.vertices, mesh.indices).value();
  return std::string(hash.begin(), hash.end());
}

class MeshRpcTest : public RpcTest {
 protected:
  std::vector<v1::Mesh> list(uint32_t page_size = 0) {
    std::vector<v1::Mesh> meshes;
    v1::ListMeshesRequest request;
    request.set_page_size(page_size);
    do {
      v1::ListMeshesResponse response;
      EXPECT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::ListMeshes, request, &response).ok());
      meshes.insert(meshes.end(), response.meshes().begin(), response.meshes().end());
      request.set_page_token(response.next_page_token());
    } while (!request.page_token().empty());
    return meshes;
  }

  grpc::Status remove_mesh(const std::string& name) {
    v1::DeleteMeshRequest request;
    request.set_mesh(name);
    v1::DeleteMeshResponse response;
    return call(*stubs().scenes, &v1::SceneService::Stub::DeleteMesh, request, &response);
  }

  // Returns an upload of the cube with two parts: one begins at triangle 0, the other at triangle `second`.
  static v1::UploadMeshRequest cube_of_parts(const std::string& name, const std::string& part, uint32_t second) {
    v1::UploadMeshRequest request = whole_mesh(name);
    request.add_parts()->set_name(part + " 0");
    request.add_parts()->set_name(part + " 1");
    request.mutable_parts(1)->set_first_triangle(second);
    return request;
  }

  // Expects that no mesh is registered, as after a refused upload.
  void expect_nothing_kept() { EXPECT_TRUE(list().empty()); }
};

TEST_F(MeshRpcTest, AMeshInOneMessageIsKnownUnderItsNameAndHash) {
  v1::UploadMeshRequest request = whole_mesh("cube");
  request.set_sha256(hash_of({}));
  v1::MeshPart* part = request.add_parts();
  part->set_name("floor");
  part = request.add_parts();
  part->set_name("rest");
  part->set_first_triangle(2);
  v1::UploadMeshResponse response;
  ASSERT_TRUE(upload({request}, &response).ok());
  EXPECT_FALSE(response.already_known());
  EXPECT_EQ(response.mesh().name(), "cube");
  EXPECT_EQ(response.mesh().sha256(), hash_of({}));
  EXPECT_EQ(response.mesh().triangles(), 12u);
  EXPECT_EQ(response.mesh().zero_area_triangles(), 0u);
  EXPECT_GT(response.mesh().bytes(), 0u);
  ASSERT_EQ(response.mesh().parts_size(), 2);
  EXPECT_EQ(response.mesh().parts(1).first_triangle(), 2u);
  ASSERT_EQ(list().size(), 1u);
  EXPECT_EQ(list()[0].SerializeAsString(), response.mesh().SerializeAsString());
}

TEST_F(MeshRpcTest, AMeshInManyPiecesIsTheSameMesh) {
  const CubeMesh cube;
  std::vector<v1::UploadMeshRequest> messages(1, whole_mesh("cube"));
  messages[0].set_sha256(hash_of(cube));
  messages[0].clear_vertices();
  messages[0].clear_indices();
  for (const float vertex : cube.vertices) messages.emplace_back().add_vertices(vertex);
  for (const uint32_t index : cube.indices) messages.emplace_back().add_indices(index);
  v1::UploadMeshResponse response;
  const grpc::Status status = upload(messages, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.mesh().sha256(), hash_of(cube));
  EXPECT_EQ(response.mesh().triangles(), 12u);
}

TEST_F(MeshRpcTest, WithoutAHashTheServerComputesIt) {
  v1::UploadMeshResponse response;
  ASSERT_TRUE(upload({whole_mesh("cube")}, &response).ok());
  EXPECT_EQ(response.mesh().sha256(), hash_of({}));
}

TEST_F(MeshRpcTest, AMeshWithAKnownHashNeedsNoColumns) {
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  v1::UploadMeshRequest request = whole_mesh("other");
  request.set_sha256(hash_of({}));
  request.clear_vertices();
  request.clear_indices();
  grpc::ClientContext context;
  set_timeout(context);
  v1::UploadMeshResponse response;
  const auto writer = stubs().scenes->UploadMesh(&context, &response);
  ASSERT_TRUE(writer->Write(request));
  // The server ends the call although the caller has not closed its side of the stream.
  const grpc::Status status = writer->Finish();
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_TRUE(response.already_known());
  EXPECT_EQ(response.mesh().name(), "other");
  EXPECT_EQ(response.mesh().triangles(), 12u);
  EXPECT_EQ(list().size(), 2u);
}

TEST_F(MeshRpcTest, ANameAcceptsTheSameBytesAgainAndRefusesOthers) {
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  v1::UploadMeshResponse response;
  ASSERT_TRUE(upload({whole_mesh("cube")}, &response).ok());
  EXPECT_TRUE(response.already_known());
  CubeMesh other;
  other.vertices[0] = -2;
  const Refused taken{grpc::StatusCode::ALREADY_EXISTS, v1::REASON_ALREADY_EXISTS, "mesh"};
  expect_refused(upload({whole_mesh("cube", other)}), taken);
  v1::UploadMeshRequest with_hash = whole_mesh("cube", other);
  with_hash.set_sha256(hash_of(other));
  expect_refused(upload({with_hash}), taken);
  EXPECT_EQ(list()[0].sha256(), hash_of({}));
}

TEST_F(MeshRpcTest, APageOfMeshesEndsBeforeAReplyThatClientsRefuse) {
  CubeMesh large;
  for (int i = 0; i < 700; ++i)
    for (int j = 0; j < 36; ++j) large.indices.push_back(large.indices[static_cast<size_t>(j)]);
  for (const std::string name : {"a", "b", "c"}) {
    v1::UploadMeshRequest request = whole_mesh(name, large);
    for (uint32_t part = 0; part < 8000; ++part) {
      request.add_parts()->set_name(std::string(limits::kMaxLabelLength, name[0]));
      request.mutable_parts(static_cast<int>(part))->set_first_triangle(part);
    }
    ASSERT_TRUE(upload({request}).ok());
  }
  v1::ListMeshesResponse page;
  ASSERT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::ListMeshes, v1::ListMeshesRequest(), &page).ok());
  EXPECT_EQ(page.meshes_size(), 1);
  EXPECT_EQ(page.next_page_token(), "a");
  const std::vector<v1::Mesh> meshes = list();
  ASSERT_EQ(meshes.size(), 3u);
  for (const v1::Mesh& mesh : meshes) EXPECT_EQ(mesh.parts_size(), 8000) << mesh.name();
}

TEST_F(MeshRpcTest, RepliesHaveAsManyPartsAsClientsAcceptAndTheRestIsAskedFor) {
  CubeMesh large;
  while (large.indices.size() < size_t{3} * limits::kMaxMeshParts)
    large.indices.push_back(large.indices[large.indices.size() % 36]);
  v1::UploadMeshRequest request = whole_mesh("large", large);
  for (uint32_t part = 0; part < limits::kMaxMeshParts; ++part) {
    request.add_parts()->set_name(std::to_string(part) + std::string(limits::kMaxLabelLength - 5, 'p'));
    request.mutable_parts(static_cast<int>(part))->set_first_triangle(part);
  }
  v1::UploadMeshResponse uploaded;
  ASSERT_TRUE(upload({request}, &uploaded).ok());
  EXPECT_LE(uploaded.ByteSizeLong(), limits::kDefaultReplyBytes);
  EXPECT_EQ(uploaded.mesh().part_count(), limits::kMaxMeshParts);
  EXPECT_GT(uploaded.mesh().parts_size(), 10'000);
  const auto page_of = [this](const v1::ListMeshesRequest& asked) {
    v1::ListMeshesResponse page;
    EXPECT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::ListMeshes, asked, &page).ok());
    return page;
  };
  v1::ListMeshesResponse page = page_of({});
  ASSERT_EQ(page.meshes_size(), 1);
  EXPECT_LE(page.ByteSizeLong(), limits::kDefaultReplyBytes);
  EXPECT_EQ(page.meshes(0).part_count(), limits::kMaxMeshParts);
  v1::ListMeshesRequest rest;
  rest.set_mesh("large");
  std::vector<v1::MeshPart> parts(page.meshes(0).parts().begin(), page.meshes(0).parts().end());
  while (parts.size() < limits::kMaxMeshParts) {
    rest.set_first_part(static_cast<uint32_t>(parts.size()));
    page = page_of(rest);
    ASSERT_EQ(page.meshes_size(), 1);
    ASSERT_GT(page.meshes(0).parts_size(), 0);
    parts.insert(parts.end(), page.meshes(0).parts().begin(), page.meshes(0).parts().end());
  }
  ASSERT_EQ(parts.size(), size_t{limits::kMaxMeshParts});
  for (uint32_t part = 0; part < limits::kMaxMeshParts; ++part) ASSERT_EQ(parts[part].first_triangle(), part);
  rest.Clear();
  rest.set_without_parts(true);
  EXPECT_EQ(page_of(rest).meshes(0).parts_size(), 0);
  EXPECT_EQ(page_of(rest).meshes(0).part_count(), limits::kMaxMeshParts);
  rest.set_mesh("missing");
  v1::ListMeshesResponse none;
  expect_refused(call(*stubs().scenes, &v1::SceneService::Stub::ListMeshes, rest, &none),
                 {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "mesh"});
  const auto client = client::Client::connect(running_.address());
  ASSERT_TRUE(client.ok());
  const absl::StatusOr<v1::Mesh> mesh = (*client)->get_mesh("large");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->parts_size(), static_cast<int>(limits::kMaxMeshParts));
  EXPECT_EQ((*client)->list_meshes()->front().parts_size(), static_cast<int>(limits::kMaxMeshParts));
  EXPECT_EQ((*client)->list_meshes(client::MeshParts::kNone)->front().parts_size(), 0);
  EXPECT_EQ((*client)->get_mesh("missing").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(MeshRpcTest, OtherPartsUnderAKnownNameAreRefused) {
  ASSERT_TRUE(upload({cube_of_parts("cube", "wall", 2)}).ok());
  v1::UploadMeshRequest again = cube_of_parts("cube", "wall", 2);
  again.set_sha256(hash_of({}));
  ASSERT_TRUE(upload({again}).ok());
  again.mutable_parts(1)->set_first_triangle(3);
  const Refused taken{grpc::StatusCode::ALREADY_EXISTS, v1::REASON_ALREADY_EXISTS, "mesh"};
  expect_refused(upload({again}), taken);
  expect_refused(upload({whole_mesh("cube")}), taken);
  ASSERT_EQ(list()[0].parts_size(), 2);
  EXPECT_EQ(list()[0].parts(1).first_triangle(), 2u);
}

TEST_F(MeshRpcTest, NamesOfEqualBytesKeepTheirOwnPartsAndUses) {
  v1::UploadMeshRequest announced = cube_of_parts("b", "door", 8);
  announced.set_sha256(hash_of({}));
  v1::UploadMeshResponse response;
  ASSERT_TRUE(upload({cube_of_parts("a", "wall", 2)}).ok());
  ASSERT_TRUE(upload({announced}, &response).ok());
  EXPECT_TRUE(response.already_known());
  EXPECT_EQ(response.mesh().parts(0).name(), "door 0");
  ASSERT_TRUE(upload({cube_of_parts("c", "roof", 4)}, &response).ok());
  EXPECT_TRUE(response.already_known());

  v1::ChangeInstancesRequest request = place_one("b", 100);
  request.mutable_place(0)->add_ids(102);
  fill(request.mutable_place(0)->mutable_translations(), {10.0, 0.0, 0.0, 30.0, 0.0, 0.0});
  *request.add_place() = place_one("c", 101).place(0);
  request.mutable_place(1)->set_translations(0, 20);
  ASSERT_TRUE(change(request).ok());
  const std::vector<v1::Mesh> meshes = list();
  ASSERT_EQ(meshes.size(), 3u);
  EXPECT_EQ(meshes[0].uses(), 0u);
  EXPECT_EQ(meshes[1].uses(), 2u);
  EXPECT_EQ(meshes[2].uses(), 1u);
  EXPECT_EQ(meshes[0].parts(1).name(), "wall 1");
  EXPECT_EQ(meshes[1].parts(1).name(), "door 1");
  EXPECT_EQ(meshes[2].parts(1).first_triangle(), 4u);

  std::vector<v1::DumpSceneResponse> pieces;
  ASSERT_TRUE(RpcTest::dump("world", &pieces).ok());
  ASSERT_EQ(pieces.size(), 1u);
  std::vector<std::string> placed;
  for (const v1::Placement& run : pieces[0].instances()) placed.push_back(run.mesh());
  EXPECT_EQ(placed, (std::vector<std::string>{"b", "c", "b"})) << "one run for each neighbour of another name";

  // A ray from x = 0 hits two sides of each cube. It hits the near side of all three cubes in the same triangle.
  v1::QueryBatch ray = ray_along_x();
  fill(ray.mutable_blocks(0)->mutable_rays()->mutable_origins(), {0.f, 0.25f, 0.f});
  ray.mutable_blocks(0)->mutable_rays()->set_mode(v1::RAY_MODE_ALL);
  v1::QueryResult result;
  ASSERT_TRUE(query(ray, &result).ok());
  EXPECT_THAT(result.blocks(0).ids(), ::testing::ElementsAre(100, 100, 101, 101, 102, 102));
  const uint32_t triangle = result.blocks(0).triangles(0);
  EXPECT_EQ(result.blocks(0).triangles(2), triangle);
  EXPECT_TRUE(triangle == 8 || triangle == 9) << triangle;
}

TEST_F(MeshRpcTest, EitherOfTwoNamesOfEqualBytesIsDeletedFirst) {
  for (const bool first_in_use : {false, true}) {
    ASSERT_TRUE(upload({whole_mesh("a")}).ok());
    ASSERT_TRUE(upload({whole_mesh("b")}).ok());
    const std::string used = first_in_use ? "a" : "b", unused = first_in_use ? "b" : "a";
    ASSERT_TRUE(change(place_one(used, 100)).ok());
    expect_refused(remove_mesh(used), {grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_IN_USE, "mesh"});
    EXPECT_TRUE(remove_mesh(unused).ok());
    v1::QueryResult result;
    ASSERT_TRUE(query(ray_along_x(), &result).ok());
    EXPECT_THAT(result.blocks(0).ids(), ::testing::ElementsAre(100));
    v1::ChangeInstancesRequest removal;
    removal.set_scene("world");
    removal.add_remove_ids(100);
    ASSERT_TRUE(change(removal).ok());
    EXPECT_TRUE(remove_mesh(used).ok());
    expect_nothing_kept();
  }
}

TEST_F(MeshRpcTest, BytesOfAnotherHashAreRefused) {
  v1::UploadMeshRequest request = whole_mesh("cube");
  request.set_sha256(std::string(32, 'x'));
  expect_refused(upload({request}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_HASH_MISMATCH, "sha256"});
  request.set_sha256("short");
  expect_refused(upload({request}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "sha256"});
  expect_nothing_kept();
}

TEST_F(MeshRpcTest, CountsAreCheckedBeforeAnythingIsAllocated) {
  v1::UploadMeshRequest request = whole_mesh("cube");
  request.set_vertex_count(0);
  expect_refused(upload({request}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "vertex_count"});
  request.set_vertex_count(limits::kMaxMeshVertices + 1);
  v1::Error error = error_of(upload({request}));
  expect_error(error, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "vertex_count"});
  EXPECT_EQ(error.limit(), "mesh_vertices");
  request = whole_mesh("cube");
  request.set_triangle_count(0);
  expect_refused(upload({request}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "triangle_count"});
  request.set_triangle_count(limits::kMaxMeshTriangles + 1);
  error = error_of(upload({request}));
  expect_error(error, {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "triangle_count"});
  EXPECT_EQ(error.asked(), limits::kMaxMeshTriangles + 1.0);
  expect_nothing_kept();
}

TEST_F(MeshRpcTest, MoreOrFewerNumbersThanAnnouncedAreRefused) {
  v1::UploadMeshRequest request = whole_mesh("cube");
  request.add_vertices(0);
  expect_refused(upload({request}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_COLUMN_LENGTH, "vertices"});
  request = whole_mesh("cube");
  v1::UploadMeshRequest more;
  more.add_indices(0);
  expect_refused(upload({request, more}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_COLUMN_LENGTH, "indices"});
  request.mutable_indices()->RemoveLast();
  expect_refused(upload({request}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_COLUMN_LENGTH, "indices"});
  request = whole_mesh("cube");
  request.mutable_vertices()->RemoveLast();
  expect_refused(upload({request}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_COLUMN_LENGTH, "vertices"});
  expect_nothing_kept();
}

TEST_F(MeshRpcTest, WrongVerticesAndIndicesAreNamedWithTheirIndex) {
  CubeMesh mesh;
  mesh.vertices[7] = std::numeric_limits<float>::quiet_NaN();
  expect_refused(upload({whole_mesh("cube", mesh)}),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_NOT_FINITE, "vertices", 2});
  mesh.vertices[7] = std::numeric_limits<float>::infinity();
  expect_refused(upload({whole_mesh("cube", mesh)}),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_NOT_FINITE, "vertices", 2});
  mesh.vertices[7] = 2e9f;
  expect_refused(upload({whole_mesh("cube", mesh)}),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_OUT_OF_RANGE, "vertices", 2});
  mesh = {};
  mesh.indices[13] = 8;
  expect_refused(upload({whole_mesh("cube", mesh)}),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_OUT_OF_RANGE, "indices", 4});
  expect_nothing_kept();
}

TEST_F(MeshRpcTest, FieldsOfTheFirstMessageAreRefusedLater) {
  v1::UploadMeshRequest again;
  again.set_mesh("cube");
  expect_refused(upload({whole_mesh("cube"), again}),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "mesh"});
  expect_refused(upload({}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, ""});
  expect_nothing_kept();
}

TEST_F(MeshRpcTest, PartsOutOfOrderAndBadNamesAreRefused) {
  v1::UploadMeshRequest request = whole_mesh("cube");
  request.add_parts()->set_first_triangle(1);
  expect_refused(upload({request}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "parts", 0});
  request.mutable_parts(0)->set_first_triangle(0);
  request.add_parts()->set_first_triangle(12);
  expect_refused(upload({request}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "parts", 1});
  request.mutable_parts(1)->set_first_triangle(3);
  request.mutable_parts(1)->set_name(std::string(limits::kMaxLabelLength + 1, 'x'));
  expect_refused(upload({request}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "parts[1].name"});
  for (const std::string& name : {std::string(), std::string("two words"), std::string(64, 'x')})
    expect_refused(upload({whole_mesh(name)}), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "mesh"});
  expect_nothing_kept();
}

TEST_F(MeshRpcTest, ZeroAreaTrianglesAreCountedAndKept) {
  CubeMesh mesh;
  mesh.indices[1] = mesh.indices[0];
  v1::UploadMeshResponse response;
  ASSERT_TRUE(upload({whole_mesh("cube", mesh)}, &response).ok());
  EXPECT_EQ(response.mesh().triangles(), 12u);
  EXPECT_EQ(response.mesh().zero_area_triangles(), 1u);
}

TEST_F(MeshRpcTest, PagesListMeshesByName) {
  for (const char* name : {"c", "a", "b"}) ASSERT_TRUE(upload({whole_mesh(name)}).ok());
  std::vector<std::string> names;
  for (const v1::Mesh& mesh : list(2)) names.push_back(mesh.name());
  EXPECT_EQ(names, (std::vector<std::string>{"a", "b", "c"}));
  v1::ListMeshesRequest request;
  v1::ListMeshesResponse response;
  request.set_page_size(limits::kMaxPageSize + 1);
  expect_refused(call(*stubs().scenes, &v1::SceneService::Stub::ListMeshes, request, &response),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_LIMIT, "page_size"});
  request.set_page_size(1);
  request.set_page_token("no token");
  expect_refused(call(*stubs().scenes, &v1::SceneService::Stub::ListMeshes, request, &response),
                 {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "page_token"});
}

TEST_F(MeshRpcTest, AMeshInUseIsNotDeleted) {
  ASSERT_TRUE(upload({whole_mesh("cube")}).ok());
  ASSERT_TRUE(change(place_one("cube", 100)).ok());
  const v1::Error error = error_of(remove_mesh("cube"));
  expect_error(error, {grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_IN_USE, "mesh"});
  EXPECT_EQ(error.asked(), 1);
  EXPECT_EQ(list()[0].uses(), 1u);
  v1::ChangeInstancesRequest removal;
  removal.set_scene("world");
  removal.add_remove_ids(100);
  ASSERT_TRUE(change(removal).ok());
  EXPECT_TRUE(remove_mesh("cube").ok());
  expect_refused(remove_mesh("cube"), {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "mesh"});
  expect_refused(remove_mesh(""), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "mesh"});
}

}  // namespace
}  // namespace locus::test
