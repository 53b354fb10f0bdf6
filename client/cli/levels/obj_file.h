// Writer of a mesh as a Wavefront OBJ file. For the commands `generate` and `mesh download`. A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_OBJ_FILE_H_
#define LOCUS_CLIENT_CLI_LEVELS_OBJ_FILE_H_

#include <ostream>

#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

// Writes the mesh to `out`. Coordinates are written as the shortest decimals that parse to the same floats, and each
// part becomes a group. The caller checks the stream for errors.
void write_obj(std::ostream& out, const ImportedMesh& mesh);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_OBJ_FILE_H_
