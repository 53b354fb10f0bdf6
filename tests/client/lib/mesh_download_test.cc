#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "client/lib/transfers.h"
#include "tests/client/lib/fake_server.h"

namespace locus::client {
namespace {

using testing::FakeServer;
using ::testing::HasSubstr;

std::string hash_of(const std::vector<float>& vertices, const std::vector<uint32_t>& indices) {
  const Sha256 hash = mesh_sha256(vertices, indices);
  return std::string(hash.begin(), hash.end());
}

// Fixture with a fake server that sends one mesh in three messages. The mesh has two triangles and four vertices.
class MeshDownloadTest : public ::testing::TestWithParam<testing::Way> {
 protected:
  void SetUp() override {
    ClientOptions options;
    options.retry = {.max_attempts = 2, .first_backoff = absl::Milliseconds(1), .max_backoff = absl::Milliseconds(2)};
    absl::StatusOr<std::unique_ptr<Client>> client = server_.connect(GetParam(), options);
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
    pieces().resize(3);
    v1::Mesh* mesh = pieces()[0].mutable_mesh();
    mesh->set_name("level");
    mesh->set_vertices(4);
    mesh->set_triangles(2);
    mesh->set_sha256(hash_of(vertices_, indices_));
    pieces()[0].add_parts()->set_name("floor");
    pieces()[0].mutable_vertices()->Add(vertices_.begin(), vertices_.begin() + 6);
    pieces()[1].mutable_vertices()->Add(vertices_.begin() + 6, vertices_.end());
    pieces()[1].mutable_indices()->Add(indices_.begin(), indices_.begin() + 3);
    pieces()[2].mutable_indices()->Add(indices_.begin() + 3, indices_.end());
  }

  std::vector<v1::DownloadMeshResponse>& pieces() { return server_.scenes.mesh_pieces; }

  void expect_damaged(const std::string& how) {
    const absl::Status status = client_->download_mesh("level").status();
    EXPECT_TRUE(absl::IsDataLoss(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("mesh level came damaged: " + how));
  }

  const std::vector<float> vertices_ = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::vector<uint32_t> indices_ = {0, 1, 2, 0, 2, 3};
  FakeServer server_;
  std::unique_ptr<Client> client_;
};

TEST_P(MeshDownloadTest, MessagesBecomeOneMeshAndProgressIsReported) {
  std::vector<uint64_t> received;
  const absl::StatusOr<DownloadedMesh> mesh = client_->download_mesh("level", [&](uint64_t bytes, uint64_t total) {
    received.push_back(bytes);
    EXPECT_EQ(total, 72u);
  });
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices, vertices_);
  EXPECT_EQ(mesh->indices, indices_);
  ASSERT_EQ(mesh->parts.size(), 1u);
  EXPECT_EQ(mesh->parts[0].name(), "floor");
  EXPECT_EQ(mesh->description.name(), "level");
  EXPECT_EQ(received, (std::vector<uint64_t>{24, 60, 72}));
}

TEST_P(MeshDownloadTest, AnUploadedMeshIsDownloadedWithTheSameHash) {
  ASSERT_TRUE(client_->upload_mesh({.name = "level", .vertices = vertices_, .indices = indices_}).ok());
  const absl::StatusOr<DownloadedMesh> mesh = client_->download_mesh("level");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const MeshColumns again = mesh->columns();
  EXPECT_EQ(mesh_sha256(again.vertices, again.indices), mesh_sha256(vertices_, indices_));
  EXPECT_EQ(again.name, "level");
  EXPECT_EQ(again.parts.size(), 1u);
}

TEST_P(MeshDownloadTest, AMissingOrRepeatedDescriptionIsDataLoss) {
  *pieces()[1].mutable_mesh() = pieces()[0].mesh();
  expect_damaged("its description is not exactly in the first message");
  pieces()[0].clear_mesh();
  expect_damaged("its description is not exactly in the first message");
  pieces().clear();
  expect_damaged("nothing came");
}

TEST_P(MeshDownloadTest, MoreOfAnyColumnThanAnnouncedIsDataLoss) {
  pieces()[2].add_indices(0);
  expect_damaged("more came than was announced");
  pieces()[2].mutable_indices()->RemoveLast();
  pieces()[2].add_vertices(0);
  expect_damaged("more came than was announced");
  pieces()[2].clear_vertices();
  pieces()[2].add_parts();
  pieces()[2].add_parts();
  expect_damaged("more came than was announced");
}

TEST_P(MeshDownloadTest, LessThanAnnouncedIsDataLoss) {
  pieces().pop_back();
  expect_damaged("less came than was announced");
}

TEST_P(MeshDownloadTest, AnIndexBeyondTheVerticesIsDataLoss) {
  pieces()[2].set_indices(0, 4);
  expect_damaged("an index is beyond its vertices");
}

TEST_P(MeshDownloadTest, AVertexThatIsNotFiniteIsDataLoss) {
  pieces()[0].set_vertices(0, std::numeric_limits<float>::quiet_NaN());
  expect_damaged("a vertex is not finite");
}

TEST_P(MeshDownloadTest, PartsOutOfOrderOrBeyondTheMeshAreDataLoss) {
  pieces()[0].mutable_parts(0)->set_first_triangle(1);
  expect_damaged("its parts do not ascend");
  pieces()[0].mutable_parts(0)->set_first_triangle(0);
  pieces()[0].add_parts();
  expect_damaged("its parts do not ascend");
  pieces()[0].mutable_parts(1)->set_first_triangle(2);
  expect_damaged("its parts do not ascend");
}

TEST_P(MeshDownloadTest, BytesOfAnotherHashAreDataLoss) {
  pieces()[0].set_vertices(0, 0.5f);
  expect_damaged("its bytes have another SHA-256 than was announced");
  pieces()[0].mutable_mesh()->clear_sha256();
  expect_damaged("its bytes have another SHA-256 than was announced");
}

TEST_P(MeshDownloadTest, ADownloadIsRetriedWhenTheServerWasUnavailable) {
  server_.scenes.failing_downloads = 1;
  EXPECT_TRUE(client_->download_mesh("level").ok());
  server_.scenes.failing_downloads = 2;
  EXPECT_TRUE(absl::IsUnavailable(client_->download_mesh("level").status()));
}

TEST_P(MeshDownloadTest, TheServersErrorForAnUnknownMeshIsReturned) {
  server_.scenes.mesh_pieces.clear();
  server_.scenes.no_mesh = true;
  const absl::Status status = client_->download_mesh("level").status();
  EXPECT_TRUE(absl::IsNotFound(status)) << status;
}

INSTANTIATE_TEST_SUITE_P(Ways, MeshDownloadTest, testing::kBothWays, testing::way_name);

}  // namespace
}  // namespace locus::client
