// Result of every importer and generator: meshes in the exact layout of an upload. Plain data. Invariants, which the
// importers and generators establish: coordinates are finite, every index is below the number of vertices, and parts
// are in ascending order of their first triangle.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORTED_MESH_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORTED_MESH_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace locus::cli {

// Named range of triangles of a mesh: from first_triangle up to the next part's first_triangle, or to the end of the
// mesh.
struct MeshPart {
  std::string name;
  uint32_t first_triangle = 0;
};

struct ImportedMesh {
  std::string name;
  std::vector<float> vertices;    // x, y, z of each vertex, interleaved
  std::vector<uint32_t> indices;  // three vertex indices per triangle, counter-clockwise seen from outside
  std::vector<MeshPart> parts;
};

struct ImportedLevel {
  std::vector<ImportedMesh> meshes;
  std::array<double, 3> recentre{};  // translation that moves the meshes back to the file's coordinates
  std::string source_format;         // "OBJ", "PLY", "STL", "glTF", "GLB" or "Quake 3 BSP"
  std::vector<std::string> notes;    // sentences for the user about anything that was skipped, chosen or changed
  bool filtered = false;             // the file was parsed under a filter of system calls
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORTED_MESH_H_
