// Check of the JSON part of a glTF or GLB file before assimp reads the file. Checks sizes, counts, nesting, and
// references to other files. The nesting is checked because assimp visits nodes recursively, and the references because
// assimp opens the referenced files. For the reader of level files. A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_GLTF_CHECK_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_GLTF_CHECK_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Checks the bytes of a file, which is a GLB file if the bytes begin with "glTF". Returns the URIs of its buffers,
// without `data:` URIs and duplicates. Images are not listed, because the importer never opens them. Returns
// INVALID_ARGUMENT for damaged JSON, a damaged container, nodes that contain themselves and nodes with several parents.
// Returns RESOURCE_EXHAUSTED if a limit of import_limits.h is exceeded. The bytes are untrusted. Cost: linear.
absl::StatusOr<std::vector<std::string>> check_gltf(absl::string_view bytes);

// Returns the path in a file reference: `uri` without its percent-encoding. Returns INVALID_ARGUMENT if the path is
// empty, is absolute, or contains a colon (as a URL does), a folder "..", a backslash or a control character. Returns
// RESOURCE_EXHAUSTED if `uri` has more than kMaxReferenceBytes.
absl::StatusOr<std::string> path_of_reference(absl::string_view uri);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_GLTF_CHECK_H_
