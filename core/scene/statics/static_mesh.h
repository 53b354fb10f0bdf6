// Mesh with its tree, ready for queries: built once from the uploaded bytes and shared by all scenes and instances. The
// tree stores every corner of every triangle, so the uploaded columns are not stored: the data that the tree lacks is
// stored packed, and the columns can be restored byte for byte. Immutable; safe to share between threads.
#ifndef LOCUS_CORE_SCENE_STATICS_STATIC_MESH_H_
#define LOCUS_CORE_SCENE_STATICS_STATIC_MESH_H_

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "core/index/bvh/triangle_bvh.h"
#include "core/mesh/packed_indices.h"
#include "core/mesh/packed_numbers.h"
#include "core/mesh/triangle_mesh.h"

namespace locus {

using Sha256 = std::array<uint8_t, 32>;

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

  const std::string& name() const { return name_; }
  const Sha256& sha256() const { return sha256_; }
  // Returns the tree. Its storage order is the order of TRIANGLES rows.
  const TriangleBvh& tree() const { return tree_; }
  uint32_t vertex_count() const { return vertex_count_; }
  uint32_t triangle_count() const { return static_cast<uint32_t>(tree_.size()); }
  uint32_t zero_area_count() const { return zero_area_count_; }
  // Returns the bounds of all triangles.
  const Aabbf& bounds() const { return tree_.bounds(); }
  const std::vector<MeshPart>& parts() const { return parts_; }
  // Returns the triangle at that position of the uploaded index list. Precondition: number < triangle_count().
  Triangle triangle(uint32_t number) const;

  // Restore the uploaded columns: 3 coordinates for each vertex; 3 vertex indices for each triangle, read in order.
  // O(size).
  std::vector<float> vertices() const;
  PackedIndices::Reader indices() const { return PackedIndices::Reader(indices_); }

  // Returns the memory of the mesh and its tree.
  uint64_t bytes() const;

 private:
  struct UnusedVertex {
    uint32_t number;
    std::array<float, 3> position;
  };

  StaticMesh(std::string name, const Sha256& sha256) : name_(std::move(name)), sha256_(sha256) {}
  void keep_columns(const TriangleMesh& mesh);
  void number_blocks();

  std::string name_;
  Sha256 sha256_;
  TriangleBvh tree_;
  PackedIndices indices_;
  PackedNumbers blocks_;  // block that contains a triangle, by triangle number
  std::vector<UnusedVertex> unused_vertices_;
  std::vector<MeshPart> parts_;
  uint32_t vertex_count_ = 0;
  uint32_t zero_area_count_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_STATICS_STATIC_MESH_H_
