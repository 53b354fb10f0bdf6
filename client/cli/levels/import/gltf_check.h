// Check of the JSON part of a glTF or GLB file before assimp reads it: sizes, counts, nesting, and the files that it
// refers to. assimp visits nodes recursively and opens what a buffer's URI names, so both are checked here. For the
// reader of level files. A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_GLTF_CHECK_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_GLTF_CHECK_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Checks the bytes of a file, which is a GLB file if it begins with "glTF". Returns the URIs of its buffers that are
// not data: URIs, without duplicates. Images are not listed, since no reader opens them. Returns INVALID_ARGUMENT for
// damaged JSON, a damaged container and nodes that contain themselves, RESOURCE_EXHAUSTED for a limit of
// import_limits.h. The bytes are untrusted. Cost: linear.
absl::StatusOr<std::vector<std::string>> check_gltf(absl::string_view bytes);

// Returns the path in a file reference: `uri` without its percent-encoding. Returns INVALID_ARGUMENT for an absolute
// path, a URL with a scheme, a path with "..", a backslash or a control character, and RESOURCE_EXHAUSTED for a path of
// more than kMaxReferenceBytes.
absl::StatusOr<std::string> path_of_reference(absl::string_view uri);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_GLTF_CHECK_H_
