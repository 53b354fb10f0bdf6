#include "core/scene/statics/static_mesh.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus {
namespace {

// Consumes the mesh, so that its columns are freed before the tree is built.
std::vector<Triangle> triangles_of(TriangleMesh mesh) {
  std::vector<Triangle> triangles;
  triangles.reserve(mesh.triangle_count());
  for (uint32_t number = 0; number < mesh.triangle_count(); ++number) triangles.push_back(mesh.triangle(number));
  return triangles;
}

}  // namespace

absl::StatusOr<std::shared_ptr<const StaticMesh>> StaticMesh::build(std::string name, const Sha256& sha256,
                                                                    TriangleMesh mesh, const BvhOptions& options) {
  const std::shared_ptr<StaticMesh> built(new StaticMesh(std::move(name), sha256));
  built->keep_columns(mesh);
  ASSIGN_OR_RETURN(TriangleBvh tree, TriangleBvh::build(triangles_of(std::move(mesh)), options));
  built->tree_ = std::move(tree);
  built->number_blocks();
  return built;
}

absl::StatusOr<std::shared_ptr<const StaticMesh>> StaticMesh::restore(std::string name, const Sha256& sha256,
                                                                      const TriangleMesh& mesh,
                                                                      const TreeTopology& topology,
                                                                      const BvhOptions& options) {
  const std::shared_ptr<StaticMesh> restored(new StaticMesh(std::move(name), sha256));
  const auto triangle = [&mesh](uint32_t number) { return mesh.triangle(number); };
  ASSIGN_OR_RETURN(TriangleBvh tree, TriangleBvh::restore(topology, mesh.triangle_count(), triangle, options));
  restored->tree_ = std::move(tree);
  restored->keep_columns(mesh);
  restored->number_blocks();
  return restored;
}

void StaticMesh::keep_columns(const TriangleMesh& mesh) {
  vertex_count_ = static_cast<uint32_t>(mesh.vertices().size() / 3);
  zero_area_count_ = mesh.zero_area_count();
  parts_ = mesh.parts();
  parts_.shrink_to_fit();
  indices_ = PackedIndices(mesh.indices());
  std::vector<bool> used(vertex_count_);
  for (const uint32_t index : mesh.indices()) used[index] = true;
  unused_vertices_.reserve(static_cast<size_t>(std::count(used.begin(), used.end(), false)));
  for (uint32_t number = 0; number < vertex_count_; ++number) {
    const float* at = &mesh.vertices()[size_t{3} * number];
    if (!used[number]) unused_vertices_.push_back({number, {at[0], at[1], at[2]}});
  }
}

void StaticMesh::number_blocks() {
  const TriangleTree tree = tree_.tree();
  blocks_ = PackedNumbers(triangle_count(), static_cast<uint32_t>(tree_.block_count() - 1));
  for (uint32_t number = 0; number < tree_.block_count(); ++number) {
    const TriangleBlock& block = tree.blocks[number];
    for (uint32_t place = 0; place < block.count; ++place) blocks_.set(tree.numbers[block.first + place], number);
  }
}

Triangle StaticMesh::triangle(uint32_t number) const {
  LOCUS_DCHECK_LT(number, triangle_count());
  const uint32_t* const numbers = tree_.tree().numbers;
  const TriangleBlock& block = tree_.tree().blocks[blocks_[number]];
  uint32_t place = 0;
  while (numbers[block.first + place] != number) ++place;
  LOCUS_DCHECK_LT(uint32_t{place}, uint32_t{block.count});
  return tree_.triangle(block, place);
}

std::vector<float> StaticMesh::vertices() const {
  std::vector<float> vertices(size_t{3} * vertex_count_);
  const auto put = [&](uint32_t number, float x, float y, float z) {
    float* at = &vertices[size_t{3} * number];
    at[0] = x;
    at[1] = y;
    at[2] = z;
  };
  PackedIndices::Reader reader = indices();
  for (uint32_t number = 0; number < triangle_count(); ++number) {
    const Triangle corners = triangle(number);
    for (const Vec3f corner : {corners.a, corners.b, corners.c}) put(reader.next(), corner.x, corner.y, corner.z);
  }
  for (const UnusedVertex& unused : unused_vertices_)
    put(unused.number, unused.position[0], unused.position[1], unused.position[2]);
  return vertices;
}

uint64_t StaticMesh::bytes() const {
  uint64_t bytes = sizeof(*this) + name_.capacity() + tree_.bytes() + indices_.bytes() + blocks_.bytes();
  bytes += unused_vertices_.capacity() * sizeof(UnusedVertex) + parts_.capacity() * sizeof(MeshPart);
  for (const MeshPart& part : parts_) bytes += part.name.capacity();
  return bytes;
}

}  // namespace locus
