// Mesh with a name, parts and a tree, ready for queries: built once from the uploaded columns and shared by all scenes
// and instances. The content of a mesh is all data that is computed from the uploaded bytes of vertices and indices,
// including the tree. Meshes of equal bytes share one content, but each has a name and parts of its own: see share().
// The tree stores every corner of every triangle, so the uploaded columns are not stored. Only the data of the columns
// that is not in the tree is stored, in packed form, so that the columns can be restored byte for byte. Immutable; safe
// to share between threads.
#ifndef LOCUS_CORE_SCENE_STATICS_STATIC_MESH_H_
#define LOCUS_CORE_SCENE_STATICS_STATIC_MESH_H_

#include <array>
#include <compare>
#include <memory>
#include <string>
#include <vector>

#include "core/index/bvh/triangle_bvh.h"
#include "core/index/bvh/winding_cells.h"
#include "core/mesh/packed_indices.h"
#include "core/mesh/packed_numbers.h"
#include "core/mesh/triangle_mesh.h"

namespace locus {

using Sha256 = std::array<uint8_t, 32>;

// Key of a mesh in records and snapshots. The name is empty in data format 1, an older format that stores only the hash
// of the content.
struct MeshKey {
  Sha256 sha256 = {};
  std::string name;

  auto operator<=>(const MeshKey&) const = default;
};

class StaticMesh {
 public:
  // Builds a mesh and its tree. Returns the errors of TriangleBvh::build(). `sha256` is the hash of the uploaded bytes;
  // build() does not verify this hash.
  static absl::StatusOr<std::shared_ptr<const StaticMesh>> build(std::string name, const Sha256& sha256,
                                                                 TriangleMesh mesh, const BvhOptions& options = {});

  // Builds a mesh and restores its tree from `topology`, which was stored for the same content. Returns the errors of
  // TriangleBvh::restore().
  static absl::StatusOr<std::shared_ptr<const StaticMesh>> restore(std::string name, const Sha256& sha256,
                                                                   const TriangleMesh& mesh,
                                                                   const TreeTopology& topology,
                                                                   const BvhOptions& options = {});

  // Returns a mesh with the given name, parts and creator that shares the content of `other`, including the tree.
  // Precondition: `parts` have passed check_parts() for this content.
  static std::shared_ptr<const StaticMesh> share(std::string name, std::vector<MeshPart> parts, const StaticMesh& other,
                                                 std::string creator = {});

  const std::string& name() const { return name_; }
  const Sha256& sha256() const { return content_->sha256; }
  MeshKey key() const { return {sha256(), name_}; }
  // Returns the tree. Overlap queries with STATIC_DETAIL_TRIANGLES return the rows of an instance in the order in which
  // the tree stores the triangles.
  const TriangleBvh& tree() const { return content_->tree; }
  uint32_t vertex_count() const { return content_->vertex_count; }
  uint32_t triangle_count() const { return static_cast<uint32_t>(tree().size()); }
  uint32_t zero_area_count() const { return content_->zero_area_count; }
  // Returns the number of open edges: see count_open_edges(). A mesh without open edges is closed and has an inside.
  uint64_t open_edges() const { return content_->open_edges; }
  bool is_closed() const { return open_edges() == 0; }
  // Returns the winding numbers of cells of space. The result has no cells if the mesh is not closed.
  const WindingCells& winding_cells() const { return content_->winding_cells; }
  // Returns the bounds of all triangles.
  const Aabbf& bounds() const { return tree().bounds(); }
  const std::vector<MeshPart>& parts() const { return parts_; }
  // Returns the caller who uploaded the mesh and whose quota it uses; empty if the mesh has no creator.
  const std::string& creator() const { return creator_; }
  // Returns triangle `number`, counted in the order of the uploaded indices. Precondition: number < triangle_count().
  Triangle triangle(uint32_t number) const;

  // Restore the uploaded columns: vertices() returns 3 coordinates for each vertex; indices() returns a reader of 3
  // vertex indices for each triangle. vertices() and the reading of all indices take O(size).
  std::vector<float> vertices() const;
  PackedIndices::Reader indices() const { return PackedIndices::Reader(content_->indices); }

  // Returns the size in bytes of the mesh, including its content.
  uint64_t bytes() const;
  // Returns the size in bytes of the content, which meshes of equal bytes share.
  uint64_t shared_bytes() const;

 private:
  struct UnusedVertex {
    uint32_t number;
    std::array<float, 3> position;
  };

  // Data that is computed from the uploaded vertices and indices, shared by meshes of equal bytes.
  struct Content {
    Sha256 sha256 = {};
    TriangleBvh tree;
    WindingCells winding_cells;
    PackedIndices indices;
    PackedNumbers blocks;  // for each triangle number, the index of the tree's TriangleBlock with this triangle
    std::vector<UnusedVertex> unused_vertices;
    uint32_t vertex_count = 0;
    uint32_t zero_area_count = 0;
    uint64_t open_edges = 0;

    void keep_columns(const TriangleMesh& mesh);
    void set_tree(TriangleBvh new_tree);
    void number_blocks();
  };

  StaticMesh(std::string name, std::vector<MeshPart> parts, std::shared_ptr<const Content> content);

  std::string name_;
  std::vector<MeshPart> parts_;
  std::string creator_;
  std::shared_ptr<const Content> content_;  // never null
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_STATICS_STATIC_MESH_H_
