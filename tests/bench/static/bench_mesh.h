// A level for the static suite, both as indexed triangles in the order of the import and as triangles with coordinates.
// Triangles without area are left out. Used by the workloads, by locus and by every peer. Immutable once made; safe to
// share.
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
  std::string name;               // the name of a case ends with this
  std::vector<float> vertices;    // 3 per vertex
  std::vector<uint32_t> indices;  // 3 per triangle
  std::vector<Triangle> triangles;
  Aabbf bounds;
  float diagonal = 0;  // length of the diagonal of the bounds
};

// Joins all meshes of a level. Returns INVALID_ARGUMENT if no triangle has an area, or the error of
// TriangleMesh::create().
absl::StatusOr<BenchMesh> bench_mesh(const std::string& name, const std::vector<cli::ImportedMesh>& meshes);

// Loads or generates `mesh`, a text whose form the help of the program describes. Returns the error of import_file() or
// bench_mesh(), or INVALID_ARGUMENT if the text of a generated mesh has a wrong number.
absl::StatusOr<BenchMesh> load_mesh(const std::string& mesh);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_BENCH_MESH_H_
