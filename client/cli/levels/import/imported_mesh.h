// What every importer and generator hands to the commands: meshes in the exact layout that an upload sends. Plain data
// without threads or handles. The writers of these structs keep: finite coordinates, every index below the vertex
// count, parts in ascending order of their first triangle.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORTED_MESH_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORTED_MESH_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace locus::cli {

// A named run of triangles: from first_triangle to the next part's first triangle, or to the end of the mesh.
struct MeshPart {
  std::string name;
  uint32_t first_triangle = 0;
};

struct ImportedMesh {
  std::string name;
  std::vector<float> vertices;    // x, y, z of each vertex, interleaved: 3 V numbers
  std::vector<uint32_t> indices;  // three vertex numbers a triangle, counter-clockwise seen from outside: 3 T numbers
  std::vector<MeshPart> parts;
};

struct ImportedLevel {
  std::vector<ImportedMesh> meshes;
  std::array<double, 3> recentre{};  // the translation to give every instance, so that the level stands where it was
  std::string source_format;         // "OBJ", "PLY", "STL", "glTF", "GLB" or "Quake 3 BSP"
  std::vector<std::string> notes;    // one sentence each, for the user: what was skipped, chosen or changed
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORTED_MESH_H_
