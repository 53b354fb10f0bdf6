// Import of OBJ, PLY, STL, glTF and GLB files. assimp parses a file; this code checks the result and bakes the node
// transforms into the vertices. For import_file(). A function without state. Only scene_import.cc includes assimp.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_SCENE_IMPORT_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_SCENE_IMPORT_H_

#include "absl/status/statusor.h"
#include "client/cli/levels/import/import_file.h"
#include "client/cli/levels/import/imported_mesh.h"
#include "client/cli/levels/import/level_files.h"

namespace locus::cli {

// Returns one mesh named after the file, with a part for each mesh of each node in depth-first order. Reads only the
// bytes in `files`. Node transforms are multiplied in double. Under a mirroring transform the vertex order of triangles
// is reversed, so that they stay counter-clockwise seen from outside. Points and lines are dropped and counted in a
// note. If assimp cannot read the file, returns INVALID_ARGUMENT with assimp's error message.
absl::StatusOr<ImportedLevel> import_scene(const LevelFiles& files, const ImportOptions& options);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_SCENE_IMPORT_H_
