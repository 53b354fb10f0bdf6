// Extraction of one level from a .pk3 file, which is a zip archive. For import_file(). A function without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

struct Pk3Level {
  std::string entry;                // path inside the archive
  std::string bytes;                // at most kMaxBspBytes
  std::vector<std::string> others;  // paths of the archive's other levels, sorted
};

// Returns one level of an archive. `entry` is the level's full path, or its file name with or without ".bsp"; case is
// ignored. An empty `entry` selects the first level in alphabetical order. `archive` is the untrusted content of the
// archive, and `name` is the archive's name in errors. Returns NOT_FOUND with a list of the archive's levels if none
// matches, INVALID_ARGUMENT if the archive cannot be read, and RESOURCE_EXHAUSTED if a limit is exceeded; the error
// names the limit. There are limits on the number of entries, on the length of their names, and on the level's unpacked
// size (kMaxBspBytes and kMaxArchiveRatio). The sizes that the archive declares are not trusted.
absl::StatusOr<Pk3Level> read_pk3_level(absl::string_view archive, const std::string& name, const std::string& entry);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_QUAKE_PK3_ARCHIVE_H_
