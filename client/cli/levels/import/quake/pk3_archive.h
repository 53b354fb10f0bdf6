// Extraction of one level from a .pk3 file, which is a zip archive. For import_file(). A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace locus::cli {

struct Pk3Level {
  std::string entry;                // path inside the archive
  std::string bytes;                // at most kMaxBspBytes
  std::vector<std::string> others;  // paths of the archive's other levels, sorted
};

// Returns the level named `entry`: its full path, or its file name with or without ".bsp", case-insensitive. An empty
// `entry` selects the first level in alphabetical order. Returns NOT_FOUND with a list of the archive's levels if none
// matches, INVALID_ARGUMENT if the archive cannot be read, and RESOURCE_EXHAUSTED if the unpacked level exceeds
// kMaxBspBytes. The size that the archive declares is not trusted.
absl::StatusOr<Pk3Level> read_pk3_level(const std::string& path, const std::string& entry);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_
