// A level as the static suite asks it: indexed as it was imported, and as triangles with their bounds, without those
// that have no area. For the workloads, for us and for every peer. Immutable once made; safe to share.
#ifndef LOCUS_TESTS_BENCH_STATIC_BENCH_MESH_H_
#define LOCUS_TESTS_BENCH_STATIC_BENCH_MESH_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/levels/import/imported_mesh.h"
#include "core/geometry/triangle.h"

namespace locus::bench {

struct BenchMesh {
  std::string name;               // as case names end
  std::vector<float> vertices;    // 3 a vertex
  std::vector<uint32_t> indices;  // 3 a triangle
  std::vector<Triangle> triangles;
  Aabbf bounds;
  float diagonal = 0;  // of the bounds
};

// All meshes of a level as one. INVALID_ARGUMENT if no triangle has an area; errors as those of
// TriangleMesh::create().
absl::StatusOr<BenchMesh> bench_mesh(const std::string& name, const std::vector<cli::ImportedMesh>& meshes);

// `mesh` as the help of the program describes it. Errors: as import_file(), and INVALID_ARGUMENT for a made-up mesh of
// an unknown kind or a wrong number.
absl::StatusOr<BenchMesh> load_mesh(const std::string& mesh);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_BENCH_MESH_H_
