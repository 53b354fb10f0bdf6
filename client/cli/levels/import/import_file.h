// Entry point of the importers: reads a file into meshes that are ready for upload. For the import command. A function
// without state; any number of threads may import at the same time.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_FILE_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_FILE_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

struct ImportOptions {
  // Level to read from a .pk3 archive, for example "maps/delta.bsp" or just "delta". If empty, the archive's first
  // level in alphabetical order is read.
  std::string entry;
  // Number n of segments along each side of a 3 x 3 Bezier patch of a Quake 3 level, from 1 to kMaxPatchSubdivisions:
  // the patch becomes n * n quads.
  int patch_subdivisions = 6;
  // Factor for every coordinate; must be finite and above 0. A Quake 3 unit is about 0.0254 m.
  double scale = 1;
};

// Reads a file of type OBJ, PLY, STL, glTF, GLB, BSP (Quake 3) or PK3. The type is determined by the file's extension
// (case-insensitive). Node transforms and the scale are baked into the vertices, polygons are triangulated, equal
// vertices are merged, axes are kept as in the file. Triangles keep the file's order, and zero-area triangles are kept.
// If the centre of the bounding box is further from the origin than 8 times the box's longest side, the level is
// recentred. To do this, all meshes are moved by the same translation, in double, before the coordinates are rounded to
// float; ImportedLevel::recentre is the inverse translation. The file is parsed by a child process (import_child.h),
// whose answer is checked. Errors: NOT_FOUND (no such file or entry), INVALID_ARGUMENT (unknown type, damaged or empty
// file, bad option, crash of the child), RESOURCE_EXHAUSTED (a limit of import_limits.h). Each message suggests a
// remedy. Cost: the file is read once and held in memory; the child needs about 60 bytes of memory for each vertex, and
// the mesh is copied twice.
absl::StatusOr<ImportedLevel> import_file(const std::string& path, const ImportOptions& options);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_FILE_H_
