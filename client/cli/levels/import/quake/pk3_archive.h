// Extraction of one level from a .pk3, which is a zip archive. For import_file(). A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace locus::cli {

struct Pk3Level {
  std::string entry;                // path inside the archive
  std::string bytes;                // at most kMaxBspBytes
  std::vector<std::string> others;  // the other levels, sorted
};

// Returns the level named `entry`: its full path, or its file name with or without ".bsp", case-insensitive. An empty
// `entry` selects the first level in alphabetical order. NOT_FOUND lists the archive's levels; INVALID_ARGUMENT for an
// archive that cannot be read; RESOURCE_EXHAUSTED if the unpacked level exceeds kMaxBspBytes; the size that the archive
// declares is not trusted.
absl::StatusOr<Pk3Level> read_pk3_level(const std::string& path, const std::string& entry);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_
