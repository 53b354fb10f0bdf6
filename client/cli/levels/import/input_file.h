// Reading of whole input files under a size limit, and the parts of a file name that the importers look at.
// Functions without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_INPUT_FILE_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_INPUT_FILE_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// "maps/Delta.BSP" gives ".bsp"; a name without an extension gives "".
std::string lower_extension(absl::string_view path);

// "maps/Delta.BSP" gives "Delta".
std::string file_stem(absl::string_view path);

// OK if the path is a readable regular file of 1 to max_bytes bytes. NOT_FOUND, INVALID_ARGUMENT, RESOURCE_EXHAUSTED.
absl::Status check_input_file(const std::string& path, uint64_t max_bytes);

// The bytes of the file, after check_input_file.
absl::StatusOr<std::string> read_input_file(const std::string& path, uint64_t max_bytes);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_INPUT_FILE_H_
