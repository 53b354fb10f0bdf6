#include "core/mesh/triangle_mesh.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"

namespace locus {
namespace {

absl::Status check_counts(const std::vector<float>& vertices, const std::vector<uint32_t>& indices) {
  if (vertices.size() % 3 != 0)
    return refuse_argument(Reason::kColumnLength, "vertices", {},
                           absl::StrCat("holds ", vertices.size(), " numbers; give x, y, z for each vertex"));
  if (indices.size() % 3 != 0)
    return refuse_argument(Reason::kColumnLength, "indices", {},
                           absl::StrCat("holds ", indices.size(), " numbers; give three for each triangle"));
  if (vertices.empty() || indices.empty())
    return refuse_argument(Reason::kMalformed, vertices.empty() ? "vertices" : "indices", {},
                           "a mesh needs at least one triangle");
  const size_t vertex_count = vertices.size() / 3, triangle_count = indices.size() / 3;
  if (vertex_count > limits::kMaxMeshVertices)
    return refuse_limit("vertices", "mesh_vertices", limits::kMaxMeshVertices, static_cast<double>(vertex_count));
  if (triangle_count > limits::kMaxMeshTriangles)
    return refuse_limit("indices", "mesh_triangles", limits::kMaxMeshTriangles, static_cast<double>(triangle_count));
  return absl::OkStatus();
}

absl::Status check_values(const std::vector<float>& vertices, const std::vector<uint32_t>& indices) {
  for (size_t i = 0; i < vertices.size(); ++i) {
    const auto vertex = static_cast<uint32_t>(i / 3);
    if (!std::isfinite(vertices[i]))
      return refuse_argument(Reason::kNotFinite, "vertices", vertex, "coordinates must be finite numbers");
    if (std::abs(vertices[i]) > limits::kMaxCoordinate)
      return refuse_argument(Reason::kOutOfRange, "vertices", vertex, "coordinates must lie within +-1e9");
  }
  const size_t vertex_count = vertices.size() / 3;
  for (size_t i = 0; i < indices.size(); ++i)
    if (indices[i] >= vertex_count)
      return refuse_argument(Reason::kOutOfRange, "indices", static_cast<uint32_t>(i / 3),
                             absl::StrCat("vertex ", indices[i], " of ", vertex_count, " does not exist"));
  return absl::OkStatus();
}

}  // namespace

absl::Status check_parts(const std::vector<MeshPart>& parts, size_t triangles) {
  if (parts.size() > limits::kMaxMeshParts)
    return refuse_limit("parts", "mesh_parts", limits::kMaxMeshParts, static_cast<double>(parts.size()));
  for (size_t i = 0; i < parts.size(); ++i) {
    const auto index = static_cast<uint32_t>(i);
    if (parts[i].name.size() > limits::kMaxLabelLength)
      return refuse_limit(absl::StrCat("parts[", i, "].name"), "label_length", limits::kMaxLabelLength,
                          static_cast<double>(parts[i].name.size()));
    const uint32_t first = parts[i].first_triangle;
    const bool in_order = i == 0 ? first == 0 : first > parts[i - 1].first_triangle;
    if (!in_order || first >= triangles)
      return refuse_argument(Reason::kMalformed, "parts", index,
                             "parts begin at triangle 0, ascend and lie within the mesh");
  }
  return absl::OkStatus();
}

absl::StatusOr<TriangleMesh> TriangleMesh::create(std::vector<float> vertices, std::vector<uint32_t> indices,
                                                  std::vector<MeshPart> parts) {
  RETURN_IF_ERROR(check_counts(vertices, indices));
  RETURN_IF_ERROR(check_values(vertices, indices));
  RETURN_IF_ERROR(check_parts(parts, indices.size() / 3));
  TriangleMesh mesh;
  mesh.vertices_ = std::move(vertices);
  mesh.indices_ = std::move(indices);
  mesh.parts_ = std::move(parts);
  for (uint32_t index = 0; index < mesh.triangle_count(); ++index) {
    const Triangle triangle = mesh.triangle(index);
    mesh.bounds_ = merge(mesh.bounds_, bounds_of(triangle));
    if (area_normal(triangle) == Vec3d{}) ++mesh.zero_area_count_;
  }
  LOCUS_DCHECK_CALL(mesh.check_invariants());
  return mesh;
}

void TriangleMesh::check_invariants() const {
  LOCUS_CHECK_EQ(vertices_.size() % 3, 0u);
  LOCUS_CHECK_EQ(indices_.size() % 3, 0u);
  LOCUS_CHECK_LT(0u, triangle_count());
  LOCUS_CHECK_LE(zero_area_count_, triangle_count());
  LOCUS_CHECK(!bounds_.empty());
}

Triangle TriangleMesh::triangle(uint32_t index) const {
  LOCUS_DCHECK_LT(index, triangle_count());
  const auto vertex = [this](uint32_t vertex_index) {
    LOCUS_DCHECK_LT(size_t{3} * vertex_index, vertices_.size());
    const float* p = &vertices_[size_t{3} * vertex_index];
    return Vec3f{p[0], p[1], p[2]};
  };
  const uint32_t* corner = &indices_[size_t{3} * index];
  return {vertex(corner[0]), vertex(corner[1]), vertex(corner[2]), index};
}

}  // namespace locus
