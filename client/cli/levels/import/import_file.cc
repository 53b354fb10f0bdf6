#include "client/cli/levels/import/import_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/string_view.h"
#include "client/cli/levels/import/import_child.h"
#include "client/cli/levels/import/import_limits.h"
#include "client/cli/levels/import/input_file.h"
#include "client/cli/levels/import/level_codec.h"
#include "client/cli/levels/import/level_files.h"
#include "client/cli/levels/import/quake/bsp_import.h"
#include "client/cli/levels/import/quake/pk3_archive.h"
#include "client/cli/levels/import/scene_import.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr std::array<absl::string_view, 5> kSceneExtensions = {".obj", ".ply", ".stl", ".gltf", ".glb"};

absl::Status check_options(const std::string& extension, const ImportOptions& options) {
  if (!std::isfinite(options.scale) || options.scale <= 0) {
    return absl::InvalidArgumentError(absl::StrCat("scale ", options.scale, ": give a finite number above 0"));
  }
  if (options.patch_subdivisions < 1 || options.patch_subdivisions > kMaxPatchSubdivisions) {
    return absl::InvalidArgumentError(
        absl::StrCat("patch subdivisions ", options.patch_subdivisions, ": give 1 to ", kMaxPatchSubdivisions));
  }
  if (!options.entry.empty() && extension != ".pk3") {
    return absl::InvalidArgumentError(
        absl::StrCat("entry ", options.entry, " is for .pk3 archives only: leave it out"));
  }
  return absl::OkStatus();
}

absl::StatusOr<ImportedLevel> import_pk3(const LevelFiles& files, const ImportOptions& options) {
  ASSIGN_OR_RETURN(Pk3Level found, read_pk3_level(files.bytes, files.name, options.entry));
  absl::StatusOr<ImportedLevel> level = import_bsp(found.bytes, file_stem(found.entry), options);
  if (!level.ok())
    return absl::Status(level.status().code(), absl::StrCat(found.entry, ": ", level.status().message()));
  level->notes.push_back(absl::StrCat("Level ", found.entry, "."));
  if (options.entry.empty() && !found.others.empty()) {
    std::vector<std::string>& others = found.others;
    const size_t unlisted = others.size() - std::min(others.size(), kMaxListedEntries);
    others.resize(others.size() - unlisted);
    level->notes.push_back(absl::StrCat("The archive holds other levels: ", absl::StrJoin(others, ", "),
                                        unlisted > 0 ? absl::StrCat(" and ", unlisted, " more.") : "."));
  }
  return level;
}

// Parses the files in memory. Runs in the child process.
absl::StatusOr<ImportedLevel> parse_files(const LevelFiles& files, const ImportOptions& options) {
  const std::string extension = lower_extension(files.name);
  if (extension == ".bsp") return import_bsp(files.bytes, file_stem(files.name), options);
  if (extension == ".pk3") return import_pk3(files, options);
  return import_scene(files, options);
}

uint64_t size_of(const LevelFiles& files) {
  uint64_t bytes = files.bytes.size();
  for (const auto& [uri, content] : files.referenced) bytes += content.size();
  return bytes;
}

}  // namespace

absl::StatusOr<ImportedLevel> import_file(const std::string& path, const ImportOptions& options) {
  const std::string extension = lower_extension(path);
  const bool is_scene =
      std::find(kSceneExtensions.begin(), kSceneExtensions.end(), extension) != kSceneExtensions.end();
  if (!is_scene && extension != ".bsp" && extension != ".pk3") {
    return absl::InvalidArgumentError(absl::StrCat("unsupported file type ", extension.empty() ? path : extension,
                                                   ": give OBJ, PLY, STL, GLB/glTF, BSP or PK3"));
  }
  RETURN_IF_ERROR(check_options(extension, options));
  ASSIGN_OR_RETURN(const LevelFiles files, read_level_files(path));
  ASSIGN_OR_RETURN(const ChildAnswer answer, run_in_child(path, limits_for(size_of(files)),
                                                          [&] { return encode_level(parse_files(files, options)); }));
  absl::StatusOr<ImportedLevel> level = decode_level(answer.bytes);
  if (level.ok()) level->filtered = answer.filtered;
  return level;
}

}  // namespace locus::cli
