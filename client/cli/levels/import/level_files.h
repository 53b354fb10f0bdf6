// Bytes of a level file and of the files that it refers to. They are read before anything parses them, so that the
// process that parses them needs no access to files. For import_file(). Functions without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_LEVEL_FILES_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_LEVEL_FILES_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/status/statusor.h"

namespace locus::cli {

struct LevelFiles {
  std::string name;                               // file name without its folder
  std::string bytes;                              // content of the file
  std::map<std::string, std::string> referenced;  // content of each other file, keyed by its URI in the level file
};

// Reads the file `path` and, if it is a glTF or GLB file, the files to which its buffers refer. Each referenced file
// must be a regular file in the folder of `path` or below it, even after symbolic links are followed. All files
// together must not exceed kMaxImportFileBytes. No other file is read: neither images nor the material library of an
// OBJ file. Returns the errors of read_input_file(), check_gltf() and path_of_reference(), NOT_FOUND for a missing
// file, INVALID_ARGUMENT for a reference that leads out of the folder.
absl::StatusOr<LevelFiles> read_level_files(const std::string& path);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_LEVEL_FILES_H_
