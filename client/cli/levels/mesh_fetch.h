// From a mesh on the server to a mesh in memory, with a progress line. For commands that write meshes to files.
#ifndef LOCUS_CLIENT_CLI_LEVELS_MESH_FETCH_H_
#define LOCUS_CLIENT_CLI_LEVELS_MESH_FETCH_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/context.h"
#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

// The mesh of that name, whole. Progress goes to the context's error stream if that is live.
absl::StatusOr<ImportedMesh> fetch_mesh(const std::string& name, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_MESH_FETCH_H_
