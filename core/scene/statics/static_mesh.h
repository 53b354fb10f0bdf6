// Named mesh with its parts and its tree, ready for queries: built once from the uploaded bytes and shared by all
// scenes and instances. Meshes of equal bytes share the tree and everything else that follows from the bytes, and have
// names and parts of their own: see share(). The tree stores every corner of every triangle, so the uploaded columns
// are not stored: the data that the tree lacks is stored packed, and the columns can be restored byte for byte.
// Immutable; safe to share between threads.
#ifndef LOCUS_CORE_SCENE_STATICS_STATIC_MESH_H_
#define LOCUS_CORE_SCENE_STATICS_STATIC_MESH_H_

#include <array>
#include <compare>
#include <memory>
#include <string>
#include <vector>

#include "core/index/bvh/triangle_bvh.h"
#include "core/mesh/packed_indices.h"
#include "core/mesh/packed_numbers.h"
#include "core/mesh/triangle_mesh.h"

namespace locus {

using Sha256 = std::array<uint8_t, 32>;

// Identifies a mesh in stored data. The name is empty in records and snapshots of format 1.
struct MeshKey {
  Sha256 sha256 = {};
  std::string name;

  auto operator<=>(const MeshKey&) const = default;
};

class StaticMesh {
 public:
  // Builds the tree. Errors: those of TriangleBvh::build(). `sha256` is the hash of the uploaded bytes; not verified.
  static absl::StatusOr<std::shared_ptr<const StaticMesh>> build(std::string name, const Sha256& sha256,
                                                                 TriangleMesh mesh, const BvhOptions& options = {});

  // Restores the tree from the topology that was stored for the same mesh. Errors: those of TriangleBvh::restore().
  static absl::StatusOr<std::shared_ptr<const StaticMesh>> restore(std::string name, const Sha256& sha256,
                                                                   const TriangleMesh& mesh,
                                                                   const TreeTopology& topology,
                                                                   const BvhOptions& options = {});

  // Returns a mesh of the bytes of `other`, which shares its tree, under another name and with other parts. `parts`
  // have passed check_parts().
  static std::shared_ptr<const StaticMesh> share(std::string name, std::vector<MeshPart> parts,
                                                 const StaticMesh& other);

  const std::string& name() const { return name_; }
  const Sha256& sha256() const { return content_->sha256; }
  MeshKey key() const { return {sha256(), name_}; }
  // Returns the tree. Its storage order is the order of TRIANGLES rows.
  const TriangleBvh& tree() const { return content_->tree; }
  uint32_t vertex_count() const { return content_->vertex_count; }
  uint32_t triangle_count() const { return static_cast<uint32_t>(tree().size()); }
  uint32_t zero_area_count() const { return content_->zero_area_count; }
  // Returns the bounds of all triangles.
  const Aabbf& bounds() const { return tree().bounds(); }
  const std::vector<MeshPart>& parts() const { return parts_; }
  // Returns the triangle at that position of the uploaded index list. Precondition: number < triangle_count().
  Triangle triangle(uint32_t number) const;

  // Restore the uploaded columns: 3 coordinates for each vertex; 3 vertex indices for each triangle, read in order.
  // O(size).
  std::vector<float> vertices() const;
  PackedIndices::Reader indices() const { return PackedIndices::Reader(content_->indices); }

  // Returns the memory of the mesh and its tree.
  uint64_t bytes() const;
  // Returns the part of bytes() that meshes of equal bytes share.
  uint64_t shared_bytes() const;

 private:
  struct UnusedVertex {
    uint32_t number;
    std::array<float, 3> position;
  };

  // Holds all that comes from the bytes.
  struct Content {
    Sha256 sha256 = {};
    TriangleBvh tree;
    PackedIndices indices;
    PackedNumbers blocks;  // by triangle number: the block that holds it
    std::vector<UnusedVertex> unused_vertices;
    uint32_t vertex_count = 0;
    uint32_t zero_area_count = 0;

    void keep_columns(const TriangleMesh& mesh);
    void number_blocks();
  };

  StaticMesh(std::string name, std::vector<MeshPart> parts, std::shared_ptr<const Content> content);

  std::string name_;
  std::vector<MeshPart> parts_;
  std::shared_ptr<const Content> content_;  // never null
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_STATICS_STATIC_MESH_H_
