#include "core/scene/static_mesh.h"

#include <utility>
#include <vector>

namespace locus {

absl::StatusOr<std::shared_ptr<const StaticMesh>> StaticMesh::build(std::string name, const Sha256& sha256,
                                                                    TriangleMesh mesh,
                                                                    const std::atomic<bool>* cancel) {
  std::vector<Triangle> triangles;
  triangles.reserve(mesh.triangle_count());
  for (uint32_t number = 0; number < mesh.triangle_count(); ++number) triangles.push_back(mesh.triangle(number));
  BvhOptions options;
  options.cancel = cancel;
  absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(triangles, options);
  if (!tree.ok()) return tree.status();
  return std::shared_ptr<const StaticMesh>(new StaticMesh(std::move(name), sha256, std::move(mesh), *std::move(tree)));
}

}  // namespace locus
