// Finds and unpacks one level inside a .pk3, which is a zip archive. For import_file. A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace locus::cli {

struct Pk3Level {
  std::string entry;                // its path inside the archive
  std::string bytes;                // at most kMaxBspBytes
  std::vector<std::string> others;  // the other levels, sorted
};

// The level that `entry` names: the whole path, or its file name with or without ".bsp", in any case. Empty takes the
// first in alphabetical order. NOT_FOUND lists what is there; INVALID_ARGUMENT for an archive that cannot be read;
// RESOURCE_EXHAUSTED for a level beyond kMaxBspBytes, whatever size the archive declares.
absl::StatusOr<Pk3Level> read_pk3_level(const std::string& path, const std::string& entry);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_
