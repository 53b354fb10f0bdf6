// A mesh with its tree, ready to be asked: built once from the uploaded bytes, shared by all scenes and instances. The
// tree holds every corner of every triangle, so the columns are not kept beside it: what it does not tell is kept
// packed, and the columns come back as they were uploaded, byte for byte. Immutable; safe to share between threads.
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
  // Builds the tree. Errors: as TriangleBvh::build(). `sha256` names the bytes and is taken on trust.
  static absl::StatusOr<std::shared_ptr<const StaticMesh>> build(std::string name, const Sha256& sha256,
                                                                 TriangleMesh mesh, const BvhOptions& options = {});

  // The same from the outline of the tree of that very mesh. Errors: as TriangleBvh::restore().
  static absl::StatusOr<std::shared_ptr<const StaticMesh>> restore(std::string name, const Sha256& sha256,
                                                                   const TriangleMesh& mesh,
                                                                   const TreeTopology& topology,
                                                                   const BvhOptions& options = {});

  const std::string& name() const { return name_; }
  const Sha256& sha256() const { return sha256_; }
  // Its storage order is the order of TRIANGLES rows.
  const TriangleBvh& tree() const { return tree_; }
  uint32_t vertex_count() const { return vertex_count_; }
  uint32_t triangle_count() const { return static_cast<uint32_t>(tree_.size()); }
  uint32_t zero_area_count() const { return zero_area_count_; }
  // Of all triangles.
  const Aabbf& bounds() const { return tree_.bounds(); }
  const std::vector<MeshPart>& parts() const { return parts_; }
  // By its number in the uploaded index list, below triangle_count().
  Triangle triangle(uint32_t number) const;

  // The uploaded columns, made anew: 3 coordinates a vertex; 3 vertex numbers a triangle, read in order. O(size).
  std::vector<float> vertices() const;
  PackedIndices::Reader indices() const { return PackedIndices::Reader(indices_); }

  // All memory that stays taken.
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
  PackedNumbers blocks_;  // by triangle number: the block that holds it
  std::vector<UnusedVertex> unused_vertices_;
  std::vector<MeshPart> parts_;
  uint32_t vertex_count_ = 0;
  uint32_t zero_area_count_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_STATICS_STATIC_MESH_H_
