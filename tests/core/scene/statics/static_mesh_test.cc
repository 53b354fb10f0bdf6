#include "core/scene/statics/static_mesh.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <map>

#include "tests/support/generated_meshes.h"

namespace locus::test {
namespace {

std::vector<uint32_t> uploaded_indices(const StaticMesh& mesh) {
  PackedIndices::Reader reader = mesh.indices();
  std::vector<uint32_t> indices(size_t{3} * mesh.triangle_count());
  for (uint32_t& index : indices) index = reader.next();
  return indices;
}

std::shared_ptr<const StaticMesh> build(const std::vector<float>& vertices, const std::vector<uint32_t>& indices,
                                        const std::vector<MeshPart>& parts = {}) {
  absl::StatusOr<TriangleMesh> mesh = TriangleMesh::create(vertices, indices, parts);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *StaticMesh::build("mesh", {}, *std::move(mesh));
}

struct UploadedColumns {
  std::vector<float> vertices;
  std::vector<uint32_t> indices;
};

// Returns columns in which corners at equal positions share one vertex; vertices are numbered in the order of their
// first use.
UploadedColumns welded(const std::vector<Triangle>& triangles) {
  UploadedColumns columns;
  std::map<std::array<float, 3>, uint32_t> known;
  for (const Triangle& triangle : triangles) {
    for (const Vec3f corner : {triangle.a, triangle.b, triangle.c}) {
      const auto [found, is_new] = known.try_emplace({corner.x, corner.y, corner.z}, known.size());
      if (is_new) columns.vertices.insert(columns.vertices.end(), {corner.x, corner.y, corner.z});
      columns.indices.push_back(found->second);
    }
  }
  return columns;
}

double bytes_a_triangle(const std::vector<Triangle>& triangles) {
  const UploadedColumns columns = welded(triangles);
  return static_cast<double>(build(columns.vertices, columns.indices)->bytes()) / static_cast<double>(triangles.size());
}

TEST(StaticMeshTest, ReturnsTheUploadedColumnsUnchanged) {
  const UploadedColumns columns = welded(box_city(9, 3));
  const auto mesh = build(columns.vertices, columns.indices);
  EXPECT_EQ(mesh->vertices(), columns.vertices);
  EXPECT_EQ(uploaded_indices(*mesh), columns.indices);
}

TEST(StaticMeshTest, KeepsUnusedAndRepeatedVerticesAndTheirOrder) {
  const std::vector<float> vertices = {9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 7, 7, 7};
  const std::vector<uint32_t> indices = {3, 2, 1, 4, 2, 3, 2, 2, 2};
  const auto mesh = build(vertices, indices);
  EXPECT_EQ(mesh->vertices(), vertices);
  EXPECT_EQ(uploaded_indices(*mesh), indices);
  EXPECT_EQ(mesh->vertex_count(), 6u);
  EXPECT_EQ(mesh->zero_area_count(), 1u);
}

TEST(StaticMeshTest, ANegativeZeroStaysNegative) {
  const auto mesh = build({-0.0f, 0, 0, 1, -0.0f, 0, 0, 1, 0}, {0, 1, 2});
  const std::vector<float> vertices = mesh->vertices();
  EXPECT_TRUE(std::signbit(vertices[0]));
  EXPECT_FALSE(std::signbit(vertices[1]));
  EXPECT_TRUE(std::signbit(vertices[4]));
}

TEST(StaticMeshTest, FindsEachTriangleByItsNumber) {
  const std::vector<Triangle> triangles = bumpy_sphere(40, 0.1, 2);
  const UploadedColumns columns = welded(triangles);
  const auto mesh = build(columns.vertices, columns.indices);
  ASSERT_EQ(mesh->triangle_count(), triangles.size());
  for (const Triangle& triangle : triangles) ASSERT_EQ(mesh->triangle(triangle.number), triangle);
}

TEST(StaticMeshTest, KeepsNameHashPartsAndBounds) {
  Sha256 sha256{};
  sha256[3] = 5;
  const auto mesh = *StaticMesh::build(
      "level", sha256, *TriangleMesh::create({0, 0, 0, 2, 0, 0, 0, 3, 0}, {0, 1, 2, 0, 2, 1}, {{"a", 0}, {"b", 1}}));
  EXPECT_EQ(mesh->name(), "level");
  EXPECT_EQ(mesh->sha256(), sha256);
  EXPECT_EQ(mesh->bounds(), (Aabbf{{0, 0, 0}, {2, 3, 0}}));
  ASSERT_EQ(mesh->parts().size(), 2u);
  EXPECT_EQ(mesh->parts()[1].name, "b");
  EXPECT_EQ(mesh->parts()[1].first_triangle, 1u);
}

TEST(StaticMeshTest, UsesAtMost72BytesATriangleInTotal) {
  EXPECT_LE(bytes_a_triangle(box_city(32, 1)), 72);
  EXPECT_LE(bytes_a_triangle(bumpy_sphere(64, 0.02, 1)), 72);
  EXPECT_LE(bytes_a_triangle(bumpy_sphere(130, 0.2, 3)), 72);
}

TEST(StaticMeshTest, CountsTheMemoryBesideTheTree) {
  const auto lean = build({0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2});
  const auto rich = build({0, 0, 0, 1, 0, 0, 0, 1, 0, 9, 9, 9}, {0, 1, 2}, {{std::string(200, 'p'), 0}});
  EXPECT_GT(lean->bytes(), lean->tree().bytes());
  EXPECT_GE(rich->bytes(), lean->bytes() + 16 + sizeof(MeshPart) + 200);
}

TEST(StaticMeshTest, AMeshThatSharesContentHasItsOwnNameAndParts) {
  const auto first = build({0, 0, 0, 2, 0, 0, 0, 3, 0, 9, 9, 9}, {0, 1, 2, 0, 2, 1}, {{"a", 0}, {"b", 1}});
  const auto second = StaticMesh::share("second", {{std::string(100, 'c'), 0}}, *first);
  EXPECT_EQ(second->name(), "second");
  ASSERT_EQ(second->parts().size(), 1u);
  EXPECT_EQ(first->parts().size(), 2u);
  EXPECT_EQ(second->sha256(), first->sha256());
  EXPECT_EQ(second->vertices(), first->vertices());
  EXPECT_EQ(uploaded_indices(*second), uploaded_indices(*first));
  EXPECT_EQ(&second->tree(), &first->tree());
  // bytes() of each of the two meshes includes the content that both share.
  EXPECT_EQ(second->shared_bytes(), first->shared_bytes());
  EXPECT_GT(second->shared_bytes(), second->tree().bytes());
  EXPECT_GE(second->bytes(), second->shared_bytes() + sizeof(MeshPart) + 100);
  EXPECT_LT(second->bytes(), second->shared_bytes() + sizeof(StaticMesh) + sizeof(MeshPart) + 200);
}

TEST(StaticMeshTest, AMeshRestoredFromItsTopologyEqualsTheOriginal) {
  const UploadedColumns columns = welded(box_city(9, 3));
  const std::vector<MeshPart> parts = {{"a", 0}, {"b", 7}};
  const auto built = build(columns.vertices, columns.indices, parts);
  const absl::StatusOr<TriangleMesh> mesh = TriangleMesh::create(columns.vertices, columns.indices, parts);
  const auto restored = StaticMesh::restore("mesh", {}, *mesh, built->tree().topology());
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ((*restored)->name(), "mesh");
  EXPECT_EQ((*restored)->vertices(), columns.vertices);
  EXPECT_EQ(uploaded_indices(**restored), columns.indices);
  EXPECT_EQ((*restored)->bounds(), built->bounds());
  EXPECT_EQ((*restored)->zero_area_count(), built->zero_area_count());
  EXPECT_EQ((*restored)->parts().size(), 2u);
  EXPECT_EQ((*restored)->bytes(), built->bytes());
  for (uint32_t number = 0; number < built->triangle_count(); ++number)
    ASSERT_EQ((*restored)->triangle(number), built->triangle(number));
}

TEST(StaticMeshTest, TheTopologyOfAnotherMeshIsRefused) {
  const UploadedColumns columns = welded(box_city(3, 3));
  const auto other = build({0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2});
  const absl::StatusOr<TriangleMesh> mesh = TriangleMesh::create(columns.vertices, columns.indices, {});
  EXPECT_EQ(StaticMesh::restore("mesh", {}, *mesh, other->tree().topology()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(StaticMeshTest, ACancelledBuildReturnsAnError) {
  const std::atomic<bool> cancel = true;
  BvhOptions options;
  options.cancel = &cancel;
  EXPECT_EQ(StaticMesh::build("mesh", {}, *TriangleMesh::create({0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}, {}), options)
                .status()
                .code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace locus::test
