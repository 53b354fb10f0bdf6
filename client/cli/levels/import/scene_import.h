// Turns OBJ, PLY, STL, glTF and GLB files into a mesh; assimp parses them, this bakes and checks what it found. For
// import_file. A function without state. The only file that sees assimp is scene_import.cc.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_SCENE_IMPORT_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_SCENE_IMPORT_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/levels/import/import_file.h"
#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

// One mesh named after the file, with a part for each mesh of each node in depth-first order. Node transforms are
// multiplied in double; a mirroring one turns its triangles round, so that their outside stays outside. Points and
// lines are dropped and counted in a note. INVALID_ARGUMENT carries the parser's own message.
absl::StatusOr<ImportedLevel> import_scene(const std::string& path, const ImportOptions& options);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_SCENE_IMPORT_H_
