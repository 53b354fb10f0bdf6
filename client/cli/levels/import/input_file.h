// Reader of whole input files under a size limit, and functions that return the parts of a file name. For the
// importers. Functions without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_INPUT_FILE_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_INPUT_FILE_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Returns the extension in lower case: ".bsp" for "maps/Delta.BSP", "" for a name without an extension.
std::string lower_extension(absl::string_view path);

// Returns the file name without its folder and extension: "Delta" for "maps/Delta.BSP".
std::string file_stem(absl::string_view path);

// Returns OK if the path is a readable regular file of 1 to `max_bytes` bytes, else NOT_FOUND, INVALID_ARGUMENT or
// RESOURCE_EXHAUSTED.
absl::Status check_input_file(const std::string& path, uint64_t max_bytes);

// Calls check_input_file() and returns the whole content of the file.
absl::StatusOr<std::string> read_input_file(const std::string& path, uint64_t max_bytes);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_INPUT_FILE_H_
