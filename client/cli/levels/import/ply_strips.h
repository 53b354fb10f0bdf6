// Unpacks the triangle strips of a PLY file, which scanners write, to faces, because assimp 5.2 reads a strip as a
// single face. For the scene importer. A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_STRIPS_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_STRIPS_H_

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Returns the file with an element `face` instead of its element `tristrips`, or nullopt if the file has no strips, or
// faces beside them. The index -1 ends a strip. Every second triangle of a strip has the opposite order of its corners,
// so its corners are swapped. Triangles with two equal corners, which join strips, are left out. Returns
// INVALID_ARGUMENT for a damaged header, a body that ends within a row, or an index that is no vertex, and the error of
// check_counts() for too many triangles. The bytes are untrusted. Cost: linear.
absl::StatusOr<std::optional<std::string>> unpack_ply_strips(absl::string_view bytes);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_STRIPS_H_
