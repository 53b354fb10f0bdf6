#include "client/cli/levels/import/input_file.h"

#include <filesystem>
#include <fstream>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/cli/levels/import/import_error.h"
#include "core/base/status_macros.h"

namespace locus::cli {

std::string lower_extension(absl::string_view path) {
  return absl::AsciiStrToLower(std::filesystem::path(std::string(path)).extension().string());
}

std::string file_stem(absl::string_view path) { return std::filesystem::path(std::string(path)).stem().string(); }

absl::Status check_input_file(const std::string& path, uint64_t max_bytes) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    return absl::NotFoundError(absl::StrCat("no file ", path, ": check the path"));
  }
  if (error) return absl::InvalidArgumentError(absl::StrCat("cannot access ", path, ": ", error.message()));
  if (status.type() != std::filesystem::file_type::regular) {
    return absl::InvalidArgumentError(absl::StrCat(path, " is not a file: give the path of one mesh or level file"));
  }
  const uint64_t size = std::filesystem::file_size(path, error);
  if (error) return absl::InvalidArgumentError(absl::StrCat("cannot access ", path, ": ", error.message()));
  if (size == 0) return absl::InvalidArgumentError(absl::StrCat(path, " is empty: export or copy it again"));
  if (size > max_bytes) {
    return exceeds(path, absl::StrCat(size, " bytes"), "import_file_bytes", max_bytes, "split it into several files");
  }
  if (!std::ifstream(path, std::ios::binary)) {
    return absl::InvalidArgumentError(absl::StrCat("cannot open ", path, ": check its permissions"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> read_input_file(const std::string& path, uint64_t max_bytes) {
  RETURN_IF_ERROR(check_input_file(path, max_bytes));
  std::error_code error;
  std::string bytes(std::filesystem::file_size(path, error), '\0');
  std::ifstream file(path, std::ios::binary);
  // Check the number of bytes read. If the file has shrunk since its size was determined, the end of `bytes` would
  // contain zeros.
  if (error || !file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
    return absl::InvalidArgumentError(absl::StrCat("cannot read ", path, " to its end: try again"));
  }
  return bytes;
}

}  // namespace locus::cli
