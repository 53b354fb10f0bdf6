// Turns a Quake 3 level into a mesh. For import_file. A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_IMPORT_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_IMPORT_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/levels/import/import_file.h"
#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

// All drawn faces of the level, doors and other brush models included, as one mesh of that name in the file's order.
// Polygons and meshes come as they are, patches tessellated, billboards are skipped and counted in a note. A part is a
// run of faces with the same texture. The file stores front faces clockwise; they are turned to counter-clockwise.
// INVALID_ARGUMENT for damaged bytes, RESOURCE_EXHAUSTED beyond kMaxBspTriangles.
absl::StatusOr<ImportedLevel> import_bsp(absl::string_view bytes, const std::string& name,
                                         const ImportOptions& options);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_IMPORT_H_
