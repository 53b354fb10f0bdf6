// Check of a PLY file before assimp reads the file. It is needed because assimp 5.2 fills a truncated body with stale
// data instead of refusing it. Strips are unpacked before (ply_strips.h). For the scene importer. A function without
// state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_CHECK_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_CHECK_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Verifies that the body of the PLY file is complete. Returns the number of faces that the header declares; the caller
// must compare this number with the number of faces that assimp reads. Returns INVALID_ARGUMENT for a damaged header,
// triangle strips beside faces or a truncated body, and the error of check_counts() for too many vertices or faces. The
// bytes are untrusted. Cost: linear.
absl::StatusOr<uint64_t> check_ply(absl::string_view bytes);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_CHECK_H_
