#include "client/cli/backup/file_error.h"

#include <cerrno>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace locus::cli {
namespace {

absl::StatusCode code_of(int error) {
  switch (error) {
    case ENOENT:
      return absl::StatusCode::kNotFound;
    case ENOSPC:
    case EDQUOT:
      return absl::StatusCode::kResourceExhausted;
    default:
      return absl::StatusCode::kFailedPrecondition;
  }
}

absl::string_view advice_of(int error) {
  switch (error) {
    case ENOENT:
      return "; check the path";
    case ENOSPC:
    case EDQUOT:
      return "; free some of that disk, or choose another";
    case EACCES:
    case EPERM:
      return "; run as the user whom it belongs to";
    case EBUSY:
    case EXDEV:
      return "; a mount point cannot be replaced: choose a new directory within it";
    default:
      return "";
  }
}

}  // namespace

absl::Status file_error(absl::string_view doing, const std::string& path, int error) {
  return absl::Status(code_of(error),
                      absl::StrCat("cannot ", doing, " ", path, ": ", std::strerror(error), advice_of(error)));
}

}  // namespace locus::cli
