#include "client/cli/extras/render/picture.h"

#include <png.h>

#include <filesystem>
#include <fstream>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

absl::Status cannot_write(const std::string& path) {
  return absl::FailedPreconditionError(absl::StrCat("cannot write ", path, ": check its folder, its rights and space"));
}

// Encodes the picture with the simplified interface of libpng 1.6, which returns errors instead of calling longjmp().
absl::StatusOr<std::vector<char>> encode(const Picture& picture) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = picture.size.width;
  image.height = picture.size.height;
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<char> file(bytes);
  if (png_image_write_to_memory(&image, file.data(), &bytes, 0, picture.pixels.data(), 0, nullptr) == 0) {
    return absl::InternalError(absl::StrCat("libpng did not encode the picture: ", image.message));
  }
  file.resize(bytes);
  return file;
}

}  // namespace

absl::Status check_png_path(const std::string& path) {
  if (!absl::EndsWithIgnoreCase(path, ".png")) {
    return absl::FailedPreconditionError(absl::StrCat(path, " does not end in .png, the only format written"));
  }
  std::error_code ignored;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder, ignored)) {
    return absl::FailedPreconditionError(absl::StrCat("cannot write ", path, ": there is no folder ", folder.string()));
  }
  if (std::filesystem::is_directory(path, ignored)) {
    return absl::FailedPreconditionError(absl::StrCat("cannot write ", path, ": it is a folder"));
  }
  return absl::OkStatus();
}

absl::Status write_png(const std::string& path, const Picture& picture) {
  ASSIGN_OR_RETURN(const std::vector<char> bytes, encode(picture));
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  return file ? absl::OkStatus() : cannot_write(path);
}

}  // namespace locus::cli
