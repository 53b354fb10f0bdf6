// Converter of a Quake 3 level to a mesh. For import_file(). A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_IMPORT_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_IMPORT_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/levels/import/import_file.h"
#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

// Returns all drawn faces of the level, including doors and other brush models, as one mesh called `name`, in the
// file's order. Polygons and meshes keep their triangles, patches are tessellated, billboards are skipped and counted
// in a note. Consecutive faces with the same texture form a part. Front faces are clockwise in the file, so their
// vertex order is reversed.
absl::StatusOr<ImportedLevel> import_bsp(absl::string_view bytes, const std::string& name,
                                         const ImportOptions& options);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_BSP_IMPORT_H_
