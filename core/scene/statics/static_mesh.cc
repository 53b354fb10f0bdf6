#include "core/scene/statics/static_mesh.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "core/mesh/open_edges.h"

namespace locus {
namespace {

// Returns the triangles of `mesh`. Consumes the mesh, so that its columns are freed before the tree is built.
// NOLINTNEXTLINE(performance-unnecessary-value-param): takes the mesh by value to consume it
std::vector<Triangle> triangles_of(TriangleMesh mesh) {
  std::vector<Triangle> triangles;
  triangles.reserve(mesh.triangle_count());
  for (uint32_t number = 0; number < mesh.triangle_count(); ++number) triangles.push_back(mesh.triangle(number));
  return triangles;
}

}  // namespace

StaticMesh::StaticMesh(std::string name, std::vector<MeshPart> parts, std::shared_ptr<const Content> content)
    : name_(std::move(name)), parts_(std::move(parts)), content_(std::move(content)) {
  parts_.shrink_to_fit();
}

absl::StatusOr<std::shared_ptr<const StaticMesh>> StaticMesh::build(std::string name, const Sha256& sha256,
                                                                    TriangleMesh mesh, const BvhOptions& options) {
  auto content = std::make_shared<Content>();
  content->sha256 = sha256;
  content->keep_columns(mesh);
  std::vector<MeshPart> parts = mesh.parts();
  ASSIGN_OR_RETURN(TriangleBvh tree, TriangleBvh::build(triangles_of(std::move(mesh)), options));
  content->set_tree(std::move(tree));
  return std::shared_ptr<const StaticMesh>(new StaticMesh(std::move(name), std::move(parts), std::move(content)));
}

absl::StatusOr<std::shared_ptr<const StaticMesh>> StaticMesh::restore(std::string name, const Sha256& sha256,
                                                                      const TriangleMesh& mesh,
                                                                      const TreeTopology& topology,
                                                                      const BvhOptions& options) {
  auto content = std::make_shared<Content>();
  content->sha256 = sha256;
  const auto triangle = [&mesh](uint32_t number) { return mesh.triangle(number); };
  ASSIGN_OR_RETURN(TriangleBvh tree, TriangleBvh::restore(topology, mesh.triangle_count(), triangle, options));
  content->keep_columns(mesh);
  content->set_tree(std::move(tree));
  return std::shared_ptr<const StaticMesh>(new StaticMesh(std::move(name), mesh.parts(), std::move(content)));
}

std::shared_ptr<const StaticMesh> StaticMesh::share(std::string name, std::vector<MeshPart> parts,
                                                    const StaticMesh& other, std::string creator) {
  LOCUS_DCHECK(check_parts(parts, other.triangle_count()).ok());
  std::shared_ptr<StaticMesh> mesh(new StaticMesh(std::move(name), std::move(parts), other.content_));
  mesh->creator_ = std::move(creator);
  return mesh;
}

void StaticMesh::Content::keep_columns(const TriangleMesh& mesh) {
  vertex_count = static_cast<uint32_t>(mesh.vertices().size() / 3);
  zero_area_count = mesh.zero_area_count();
  open_edges = count_open_edges(mesh.vertices(), mesh.indices());
  indices = PackedIndices(mesh.indices());
  std::vector<bool> used(vertex_count);
  for (const uint32_t index : mesh.indices()) used[index] = true;
  unused_vertices.reserve(static_cast<size_t>(std::count(used.begin(), used.end(), false)));
  for (uint32_t number = 0; number < vertex_count; ++number) {
    const float* at = &mesh.vertices()[size_t{3} * number];
    if (!used[number]) unused_vertices.push_back({number, {at[0], at[1], at[2]}});
  }
}

// Sets the tree, and computes the winding cells and the block numbers from the tree. Call after keep_columns().
void StaticMesh::Content::set_tree(TriangleBvh new_tree) {
  tree = std::move(new_tree);
  if (open_edges == 0) winding_cells = WindingCells::build(tree);
  number_blocks();
}

void StaticMesh::Content::number_blocks() {
  const TriangleTree nodes = tree.tree();
  blocks = PackedNumbers(static_cast<uint32_t>(tree.size()), static_cast<uint32_t>(tree.block_count() - 1));
  for (uint32_t number = 0; number < tree.block_count(); ++number) {
    const TriangleBlock& block = nodes.blocks[number];
    for (uint32_t place = 0; place < block.count; ++place) blocks.set(nodes.numbers[block.first + place], number);
  }
}

Triangle StaticMesh::triangle(uint32_t number) const {
  LOCUS_DCHECK_LT(number, triangle_count());
  const uint32_t* const numbers = tree().tree().numbers;
  const TriangleBlock& block = tree().tree().blocks[content_->blocks[number]];
  uint32_t place = 0;
  while (numbers[block.first + place] != number) ++place;
  LOCUS_DCHECK_LT(uint32_t{place}, uint32_t{block.count});
  return tree().triangle(block, place);
}

std::vector<float> StaticMesh::vertices() const {
  std::vector<float> vertices(size_t{3} * vertex_count());
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
  for (const UnusedVertex& unused : content_->unused_vertices)
    put(unused.number, unused.position[0], unused.position[1], unused.position[2]);
  return vertices;
}

uint64_t StaticMesh::bytes() const {
  uint64_t bytes =
      sizeof(*this) + name_.capacity() + creator_.capacity() + shared_bytes() + parts_.capacity() * sizeof(MeshPart);
  for (const MeshPart& part : parts_) bytes += part.name.capacity();
  return bytes;
}

uint64_t StaticMesh::shared_bytes() const {
  return sizeof(Content) + content_->tree.bytes() + content_->winding_cells.bytes() + content_->indices.bytes() +
         content_->blocks.bytes() + content_->unused_vertices.capacity() * sizeof(UnusedVertex);
}

}  // namespace locus
