#include "core/base/limits.h"
#include "server/convert/convert.h"
#include "server/services/sha256.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

constexpr size_t kMaxPiece = 4'000'000;
constexpr uint32_t kParts = 30'000;

class MeshDownloadRpcTest : public RpcTest {
 protected:
  grpc::Status download(const std::string& mesh, std::vector<v1::DownloadMeshResponse>* pieces) {
    v1::DownloadMeshRequest request;
    request.set_mesh(mesh);
    grpc::ClientContext context;
    set_timeout(context);
    const auto reader = stubs().scenes->DownloadMesh(&context, request);
    v1::DownloadMeshResponse piece;
    while (reader->Read(&piece)) pieces->push_back(piece);
    return reader->Finish();
  }

  std::vector<v1::DownloadMeshResponse> pieces_of(const std::string& mesh) {
    std::vector<v1::DownloadMeshResponse> pieces;
    const grpc::Status status = download(mesh, &pieces);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return pieces;
  }

  static v1::DownloadMeshResponse joined(const std::vector<v1::DownloadMeshResponse>& pieces) {
    v1::DownloadMeshResponse all;
    for (const v1::DownloadMeshResponse& piece : pieces) all.MergeFrom(piece);
    return all;
  }
};

// Returns a mesh that is downloaded in several pieces: 400,000 vertices and 500,000 triangles, without parts.
CubeMesh large_mesh() {
  CubeMesh mesh;
  for (uint32_t i = 0; i < 1'200'000 - 24; ++i) mesh.vertices.push_back(static_cast<float>(i % 1021));
  for (uint32_t i = 0; i < 1'500'000 - 36; ++i) mesh.indices.push_back(i * 7 % 400'000);
  return mesh;
}

v1::UploadMeshRequest with_parts(v1::UploadMeshRequest request, uint32_t parts, size_t name_length) {
  for (uint32_t part = 0; part < parts; ++part) {
    v1::MeshPart* added = request.add_parts();
    added->set_name(std::string(name_length, static_cast<char>('a' + part % 26)));
    added->set_first_triangle(part);
  }
  return request;
}

TEST_F(MeshDownloadRpcTest, ASmallMeshIsOnePieceWithEverythingInIt) {
  v1::UploadMeshResponse uploaded;
  ASSERT_TRUE(upload({with_parts(whole_mesh("cube"), 2, 3)}, &uploaded).ok());
  const std::vector<v1::DownloadMeshResponse> pieces = pieces_of("cube");
  ASSERT_EQ(pieces.size(), 1u);
  const CubeMesh cube;
  EXPECT_THAT(pieces[0].vertices(), ::testing::ElementsAreArray(cube.vertices));
  EXPECT_THAT(pieces[0].indices(), ::testing::ElementsAreArray(cube.indices));
  EXPECT_EQ(pieces[0].mesh().sha256(), uploaded.mesh().sha256());
  EXPECT_EQ(pieces[0].mesh().triangles(), 12u);
  EXPECT_EQ(pieces[0].mesh().vertices(), 8u);
  EXPECT_EQ(pieces[0].mesh().parts_size(), 0);
  ASSERT_EQ(pieces[0].parts_size(), 2);
  EXPECT_EQ(pieces[0].parts(1).name(), "bbb");
  EXPECT_EQ(pieces[0].parts(1).first_triangle(), 1u);
}

TEST_F(MeshDownloadRpcTest, ALargeMeshWithManyPartsIsSentInBoundedPiecesWithItsHash) {
  v1::UploadMeshResponse uploaded;
  ASSERT_TRUE(upload({with_parts(whole_mesh("large", large_mesh()), kParts, limits::kMaxLabelLength)}, &uploaded).ok());
  const std::vector<v1::DownloadMeshResponse> pieces = pieces_of("large");
  for (const v1::DownloadMeshResponse& piece : pieces) {
    EXPECT_LE(piece.ByteSizeLong(), kMaxPiece);
    EXPECT_EQ(piece.vertices_size() % 3, 0);
    EXPECT_EQ(piece.indices_size() % 3, 0);
    EXPECT_EQ(piece.has_mesh(), &piece == &pieces.front());
  }
  const v1::DownloadMeshResponse all = joined(pieces);
  EXPECT_EQ(all.parts_size(), static_cast<int>(kParts));
  const Sha256 hash = server::mesh_hash(server::span_of(all.vertices()), server::span_of(all.indices())).value();
  EXPECT_EQ(std::string(hash.begin(), hash.end()), uploaded.mesh().sha256());
}

TEST_F(MeshDownloadRpcTest, APieceIsFullBeforeTheNextBegins) {
  ASSERT_TRUE(upload({whole_mesh("large", large_mesh())}).ok());
  const std::vector<v1::DownloadMeshResponse> pieces = pieces_of("large");
  EXPECT_EQ(pieces.size(), 3u);  // the mesh has 10.8 MB
  for (size_t i = 0; i + 1 < pieces.size(); ++i) EXPECT_GT(pieces[i].ByteSizeLong(), kMaxPiece - 2048);
}

TEST_F(MeshDownloadRpcTest, UnknownAndInvalidMeshNamesAreRefused) {
  std::vector<v1::DownloadMeshResponse> none;
  expect_refused(download("absent", &none), {grpc::StatusCode::NOT_FOUND, v1::REASON_NOT_FOUND, "mesh"});
  expect_refused(download("two words", &none), {grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED, "mesh"});
  EXPECT_TRUE(none.empty());
}

TEST_F(MeshDownloadRpcTest, AMeshDeletedDuringItsDownloadIsSentCompletely) {
  ASSERT_TRUE(upload({whole_mesh("large", large_mesh())}).ok());
  v1::DownloadMeshRequest request;
  request.set_mesh("large");
  grpc::ClientContext context;
  set_timeout(context);
  const auto reader = stubs().scenes->DownloadMesh(&context, request);
  std::vector<v1::DownloadMeshResponse> pieces(1);
  ASSERT_TRUE(reader->Read(&pieces[0]));
  v1::DeleteMeshRequest removal;
  removal.set_mesh("large");
  v1::DeleteMeshResponse removed;
  ASSERT_TRUE(call(*stubs().scenes, &v1::SceneService::Stub::DeleteMesh, removal, &removed).ok());
  for (v1::DownloadMeshResponse piece; reader->Read(&piece);) pieces.push_back(piece);
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(joined(pieces).indices_size(), 1'500'000);
}

TEST_F(MeshDownloadRpcTest, ACancelledCallEndsTheDownload) {
  ASSERT_TRUE(upload({whole_mesh("large", large_mesh())}).ok());
  v1::DownloadMeshRequest request;
  request.set_mesh("large");
  grpc::ClientContext context;
  set_timeout(context);
  const auto reader = stubs().scenes->DownloadMesh(&context, request);
  v1::DownloadMeshResponse piece;
  ASSERT_TRUE(reader->Read(&piece));
  context.TryCancel();
  while (reader->Read(&piece)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_EQ(pieces_of("large").size(), 3u);
}

}  // namespace
}  // namespace locus::test
