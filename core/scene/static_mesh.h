// A mesh with its tree, ready to be asked: built once from the uploaded bytes, shared by all scenes and instances.
// Immutable; safe to share between threads.
#ifndef LOCUS_CORE_SCENE_STATIC_MESH_H_
#define LOCUS_CORE_SCENE_STATIC_MESH_H_

#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "core/index/bvh/triangle_bvh.h"
#include "core/mesh/triangle_mesh.h"

namespace locus {

using Sha256 = std::array<uint8_t, 32>;

class StaticMesh {
 public:
  // Builds the tree; CANCELLED when `cancel` turns true meanwhile. `sha256` names the bytes and is taken on trust.
  static absl::StatusOr<std::shared_ptr<const StaticMesh>> build(std::string name, const Sha256& sha256,
                                                                 TriangleMesh mesh,
                                                                 const std::atomic<bool>* cancel = nullptr);

  const std::string& name() const { return name_; }
  const Sha256& sha256() const { return sha256_; }
  const TriangleMesh& mesh() const { return mesh_; }
  // Its storage order is the order of TRIANGLES rows.
  const TriangleBvh& tree() const { return tree_; }
  uint64_t bytes() const { return mesh_.bytes() + tree_.bytes(); }

 private:
  StaticMesh(std::string name, const Sha256& sha256, TriangleMesh mesh, TriangleBvh tree)
      : name_(std::move(name)), sha256_(sha256), mesh_(std::move(mesh)), tree_(std::move(tree)) {}

  std::string name_;
  Sha256 sha256_;
  TriangleMesh mesh_;
  TriangleBvh tree_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_STATIC_MESH_H_
