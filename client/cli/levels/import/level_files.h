// The bytes of a level file and of the files that it refers to, read before anything parses them, so that the parsing
// process needs no access to files. For import_file(). Functions without state.
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
  std::map<std::string, std::string> referenced;  // content of each other file, by the URI that the level file uses
};

// Reads a file, and if it is a glTF or GLB file, the files that its buffers refer to. These must be regular files in
// the file's folder or below it, also after symbolic links are followed; all files together must not exceed
// kMaxImportFileBytes. No other file is read: not the material library of an OBJ file, and no image. Returns the errors
// of read_input_file(), check_gltf() and path_of_reference(), NOT_FOUND for a missing file, INVALID_ARGUMENT for a
// reference that leads out of the folder.
absl::StatusOr<LevelFiles> read_level_files(const std::string& path);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_LEVEL_FILES_H_
