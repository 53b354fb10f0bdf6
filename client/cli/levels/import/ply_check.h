// Judges a PLY file before and after assimp reads it: assimp 5.2 takes triangle strips for single faces and fills up
// truncated bodies with leftovers instead of refusing them. For the scene importer. Functions without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_CHECK_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_CHECK_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// The number of faces that the header of this PLY file declares, once its body is known to be whole. INVALID_ARGUMENT
// for a damaged header, triangle strips or a body that ends early, naming the element. The bytes are untrusted. Linear.
absl::StatusOr<uint64_t> check_ply(absl::string_view bytes);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_PLY_CHECK_H_
