// Check of a PLY file before assimp reads it. assimp 5.2 reads a triangle strip as a single face, and fills a truncated
// body with stale data instead of refusing it. For the scene importer. Functions without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_CHECK_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_CHECK_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Verifies that the body of the PLY file is complete, and returns the number of faces that its header declares, to be
// compared with the number that assimp reads. INVALID_ARGUMENT for a damaged header, triangle strips or a body that
// ends early, naming the element. The bytes are untrusted. Linear.
absl::StatusOr<uint64_t> check_ply(absl::string_view bytes);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_CHECK_H_
