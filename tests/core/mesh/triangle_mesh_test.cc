#include "core/mesh/triangle_mesh.h"

#include <limits>

#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "gtest/gtest.h"

namespace locus {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

const std::vector<float> kSquare = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
const std::vector<uint32_t> kTwoTriangles = {0, 1, 2, 0, 2, 3};

void expect_refused(const absl::StatusOr<TriangleMesh>& mesh, Reason reason, const std::string& field,
                    std::optional<uint32_t> index) {
  ASSERT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
  const std::optional<Refusal> refusal = refusal_of(mesh.status());
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->reason, reason) << mesh.status();
  EXPECT_EQ(refusal->field, field);
  EXPECT_EQ(refusal->index, index);
}

absl::StatusOr<TriangleMesh> with_coordinate(size_t position, float value) {
  std::vector<float> vertices = kSquare;
  vertices[position] = value;
  return TriangleMesh::create(vertices, kTwoTriangles, {});
}

TEST(TriangleMeshTest, TrianglesAreNumberedByTheirPositionInTheIndexList) {
  const auto mesh = TriangleMesh::create(kSquare, kTwoTriangles, {});
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->triangle_count(), 2u);
  EXPECT_EQ(mesh->triangle(1).number, 1u);
  EXPECT_EQ(mesh->triangle(1).b, (Vec3f{1, 1, 0}));
  EXPECT_EQ(mesh->triangle(1).c, (Vec3f{0, 1, 0}));
}

TEST(TriangleMeshTest, KeepsTheUploadedColumns) {
  const auto mesh = TriangleMesh::create(kSquare, kTwoTriangles, {{"floor", 0}, {"wall", 1}});
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->vertices(), kSquare);
  EXPECT_EQ(mesh->indices(), kTwoTriangles);
  ASSERT_EQ(mesh->parts().size(), 2u);
  EXPECT_EQ(mesh->parts()[1].name, "wall");
  EXPECT_EQ(mesh->parts()[1].first_triangle, 1u);
}

TEST(TriangleMeshTest, BoundsContainTrianglesButNotUnusedVertices) {
  std::vector<float> vertices = kSquare;
  vertices.insert(vertices.end(), {100, -100, 100});
  const auto mesh = TriangleMesh::create(vertices, kTwoTriangles, {});
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->bounds().min, (Vec3f{0, 0, 0}));
  EXPECT_EQ(mesh->bounds().max, (Vec3f{1, 1, 0}));
}

TEST(TriangleMeshTest, NanIsRefusedWithItsVertex) {
  expect_refused(with_coordinate(7, kNan), Reason::kNotFinite, "vertices", 2);
}

TEST(TriangleMeshTest, InfinityIsRefusedWithItsVertex) {
  expect_refused(with_coordinate(11, -kInfinity), Reason::kNotFinite, "vertices", 3);
}

TEST(TriangleMeshTest, AnUnusedVertexIsCheckedToo) {
  std::vector<float> vertices = kSquare;
  vertices.insert(vertices.end(), {0, kNan, 0});
  expect_refused(TriangleMesh::create(vertices, kTwoTriangles, {}), Reason::kNotFinite, "vertices", 4);
}

TEST(TriangleMeshTest, TheLargestCoordinateIsAcceptedAndTheNextFloatIsNot) {
  EXPECT_TRUE(with_coordinate(3, 1e9f).ok());
  EXPECT_TRUE(with_coordinate(3, -1e9f).ok());
  expect_refused(with_coordinate(3, std::nextafter(1e9f, kInfinity)), Reason::kOutOfRange, "vertices", 1);
  expect_refused(with_coordinate(3, std::nextafter(-1e9f, -kInfinity)), Reason::kOutOfRange, "vertices", 1);
}

TEST(TriangleMeshTest, AnIndexBeyondTheVerticesIsRefusedWithItsTriangle) {
  expect_refused(TriangleMesh::create(kSquare, {0, 1, 2, 0, 4, 3}, {}), Reason::kOutOfRange, "indices", 1);
  expect_refused(TriangleMesh::create(kSquare, {0, 1, 0xFFFFFFFFu}, {}), Reason::kOutOfRange, "indices", 0);
}

TEST(TriangleMeshTest, AMeshWithoutTrianglesIsRefused) {
  expect_refused(TriangleMesh::create(kSquare, {}, {}), Reason::kMalformed, "indices", {});
  expect_refused(TriangleMesh::create({}, {0, 1, 2}, {}), Reason::kMalformed, "vertices", {});
}

TEST(TriangleMeshTest, IncompleteVerticesAndTrianglesAreRefused) {
  expect_refused(TriangleMesh::create({0, 0, 0, 1}, {0, 0, 0}, {}), Reason::kColumnLength, "vertices", {});
  expect_refused(TriangleMesh::create(kSquare, {0, 1, 2, 3}, {}), Reason::kColumnLength, "indices", {});
}

TEST(TriangleMeshTest, PartsBeginAtTheFirstTriangle) {
  expect_refused(TriangleMesh::create(kSquare, kTwoTriangles, {{"late", 1}}), Reason::kMalformed, "parts", 0);
}

TEST(TriangleMeshTest, PartsAscend) {
  expect_refused(TriangleMesh::create(kSquare, kTwoTriangles, {{"a", 0}, {"b", 0}}), Reason::kMalformed, "parts", 1);
}

TEST(TriangleMeshTest, PartsBeginWithinTheMesh) {
  expect_refused(TriangleMesh::create(kSquare, kTwoTriangles, {{"a", 0}, {"b", 2}}), Reason::kMalformed, "parts", 1);
}

TEST(TriangleMeshTest, TooLongAPartNameIsRefusedWithTheLimit) {
  const std::string name(limits::kMaxLabelLength + 1, 'x');
  const auto mesh = TriangleMesh::create(kSquare, kTwoTriangles, {{"a", 0}, {name, 1}});
  expect_refused(mesh, Reason::kLimit, "parts[1].name", {});
  EXPECT_EQ(refusal_of(mesh.status())->limit, "label_length");
}

TEST(TriangleMeshTest, TooManyPartsAreRefusedWithTheLimit) {
  const std::vector<MeshPart> parts(limits::kMaxMeshParts + 1);
  const auto mesh = TriangleMesh::create(kSquare, kTwoTriangles, parts);
  expect_refused(mesh, Reason::kLimit, "parts", {});
  EXPECT_EQ(refusal_of(mesh.status())->limit, "mesh_parts");
}

TEST(TriangleMeshTest, ZeroAreaTrianglesAreCountedAndKeepTheirNumbers) {
  // Three triangles: one with a repeated corner, one with its corners in a line, and one with area.
  const std::vector<float> vertices = {0, 0, 0, 1, 2, 3, 2, 4, 6, 0, 1, 0};
  const auto mesh = TriangleMesh::create(vertices, {0, 0, 1, 0, 1, 2, 0, 1, 3}, {});
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->zero_area_count(), 2u);
  EXPECT_EQ(mesh->triangle_count(), 3u);
  EXPECT_EQ(mesh->triangle(2).c, (Vec3f{0, 1, 0}));
  EXPECT_EQ(mesh->triangle(2).number, 2u);
}

TEST(TriangleMeshTest, TheTiniestTriangleHasArea) {
  const float d = std::numeric_limits<float>::denorm_min();
  const auto mesh = TriangleMesh::create({0, 0, 0, d, 0, 0, 0, d, 0}, {0, 1, 2}, {});
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->zero_area_count(), 0u);
}

}  // namespace
}  // namespace locus
