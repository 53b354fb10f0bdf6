// A level for the static suite: indexed as it was imported, and as triangles with their bounds, without triangles that
// have no area. For the workloads, for locus and for every peer. Immutable once made; safe to share.
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
  std::string name;               // last part of case names
  std::vector<float> vertices;    // 3 per vertex
  std::vector<uint32_t> indices;  // 3 per triangle
  std::vector<Triangle> triangles;
  Aabbf bounds;
  float diagonal = 0;  // of the bounds
};

// Joins all meshes of a level. INVALID_ARGUMENT if no triangle has an area; errors as those of TriangleMesh::create().
absl::StatusOr<BenchMesh> bench_mesh(const std::string& name, const std::vector<cli::ImportedMesh>& meshes);

// Loads or generates `mesh`, which has a form that the help of the program describes. Errors: as import_file(), and
// INVALID_ARGUMENT for a generated mesh of an unknown kind or a wrong number.
absl::StatusOr<BenchMesh> load_mesh(const std::string& mesh);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_BENCH_MESH_H_
