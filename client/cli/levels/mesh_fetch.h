// Download of a mesh from the server into memory, with its progress. For commands that write meshes to files. A
// function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_MESH_FETCH_H_
#define LOCUS_CLIENT_CLI_LEVELS_MESH_FETCH_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/context.h"
#include "client/cli/levels/import/imported_mesh.h"
#include "core/base/progress_writer.h"

namespace locus::cli {

// Downloads the mesh `name` with all its parts. Returns the errors of Context::connect() and of the
// download.
absl::StatusOr<ImportedMesh> fetch_mesh(const std::string& name, Context& context, ProgressWriter& progress);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_MESH_FETCH_H_
