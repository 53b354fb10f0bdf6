#include "client/cli/levels/import/level_files.h"

#include <filesystem>
#include <system_error>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/levels/import/clean_text.h"
#include "client/cli/levels/import/gltf_check.h"
#include "client/cli/levels/import/import_error.h"
#include "client/cli/levels/import/import_limits.h"
#include "client/cli/levels/import/input_file.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxShownReference = 80;

// Returns the path of a referenced file, without symbolic links. Precondition: path_of_reference() returned `relative`.
absl::StatusOr<std::string> find_referenced(const fs::path& folder, const std::string& relative) {
  std::error_code error;
  const fs::path root = fs::canonical(folder.empty() ? fs::path(".") : folder, error);
  const fs::path target = error ? fs::path() : fs::canonical(root / relative, error);
  const std::string shown = clean_text(relative, kMaxShownReference);
  if (error) {
    return absl::NotFoundError(absl::StrCat("the file refers to ", shown, ", which cannot be opened: ", error.message(),
                                            "; put all files into one folder"));
  }
  const fs::path inside = target.lexically_relative(root);
  if (inside.empty() || *inside.begin() == "..") {
    return absl::InvalidArgumentError(absl::StrCat("the file refers to ", shown,
                                                   ", a link that leads out of the file's folder: copy the file "
                                                   "into the folder, or export it as GLB"));
  }
  return target.string();
}

absl::Status read_referenced(const fs::path& folder, const std::string& uri, uint64_t& bytes_left, LevelFiles& files) {
  ASSIGN_OR_RETURN(const std::string relative, path_of_reference(uri));
  ASSIGN_OR_RETURN(const std::string path, find_referenced(folder, relative));
  RETURN_IF_ERROR(check_input_file(path, kMaxImportFileBytes));
  std::error_code error;
  if (fs::file_size(path, error) > bytes_left || error) {
    return exceeds("the file and those that it refers to", "more bytes", "import_file_bytes", kMaxImportFileBytes,
                   "split it into several files");
  }
  ASSIGN_OR_RETURN(std::string bytes, read_input_file(path, bytes_left));
  bytes_left -= bytes.size();
  files.referenced.emplace(uri, std::move(bytes));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<LevelFiles> read_level_files(const std::string& path) {
  const std::string extension = lower_extension(path);
  LevelFiles files;
  files.name = fs::path(path).filename().string();
  RETURN_IF_ERROR(check_input_file(path, kMaxImportFileBytes));
  std::error_code error;
  if (extension == ".bsp" && fs::file_size(path, error) > kMaxBspBytes) {
    return exceeds(path, "more bytes", "level_bytes", kMaxBspBytes, "give another level");
  }
  ASSIGN_OR_RETURN(files.bytes, read_input_file(path, kMaxImportFileBytes));
  if (extension != ".gltf" && extension != ".glb") return files;
  ASSIGN_OR_RETURN(const std::vector<std::string> uris, check_gltf(files.bytes));
  uint64_t bytes_left = kMaxImportFileBytes - files.bytes.size();
  for (const std::string& uri : uris) {
    RETURN_IF_ERROR(read_referenced(fs::path(path).parent_path(), uri, bytes_left, files));
  }
  return files;
}

}  // namespace locus::cli
