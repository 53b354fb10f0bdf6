#include "client/cli/backup/partial_directory.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

namespace fs = std::filesystem;

// File modes that give access to the owner only, since a scene's data may be confidential.
constexpr mode_t kFolderMode = 0700;
constexpr mode_t kFileMode = 0600;

// Returns the absolute path without a trailing slash, so that a suffix can be appended.
std::string absolute(const std::string& path) {
  std::error_code why;
  std::string text = fs::absolute(path, why).lexically_normal().string();
  if (why || text.empty()) text = path;
  while (text.size() > 1 && text.back() == '/') text.pop_back();
  return text;
}

absl::Status sync_folder(const std::string& path) {
  const int folder = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return file_error("open", path, errno);
  const int failed = fsync(folder) == 0 ? 0 : errno;
  close(folder);
  return failed == 0 ? absl::OkStatus() : file_error("sync", path, failed);
}

absl::Status make_folder(const std::string& path) {
  return mkdir(path.c_str(), kFolderMode) == 0 ? absl::OkStatus() : file_error("make", path, errno);
}

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

PartialDirectory::PartialDirectory(const std::string& target, TargetRule rule)
    : target_(absolute(target)), partial_(target_ + ".partial"), rule_(rule) {}

PartialDirectory::~PartialDirectory() {
  if (file_ >= 0) close(file_);
  std::error_code ignored;
  if (made_) fs::remove_all(partial_, ignored);
}

absl::Status PartialDirectory::check() const {
  std::error_code why;
  const fs::file_status there = fs::symlink_status(target_, why);
  if (fs::exists(there)) {
    if (rule_ == TargetRule::kNothing)
      return absl::FailedPreconditionError(absl::StrCat(target_, " exists already: choose another directory"));
    if (!fs::is_directory(there) || !fs::is_empty(target_, why) || why)
      return absl::FailedPreconditionError(absl::StrCat(
          target_, " is not an empty directory, and nothing is overwritten: choose another, or move this one away"));
  }
  if (fs::exists(fs::symlink_status(partial_, why)))
    return absl::FailedPreconditionError(
        absl::StrCat(partial_,
                     " is there, left by an interrupted run or in use by another: remove it if nobody writes "
                     "to it, or choose another directory"));
  return absl::OkStatus();
}

absl::Status PartialDirectory::make(uint64_t bytes) {
  RETURN_IF_ERROR(check());
  RETURN_IF_ERROR(make_folder(partial_));
  made_ = true;
  std::error_code why;
  const fs::space_info space = fs::space(partial_, why);
  if (!why && space.available < bytes)
    return absl::ResourceExhaustedError(absl::StrCat(target_, " would take ", bytes, " bytes, its disk has room for ",
                                                     space.available, ": free some of it, or choose another disk"));
  return absl::OkStatus();
}

absl::Status PartialDirectory::make_folders_of(const std::string& path) {
  for (size_t slash = path.find('/'); slash != std::string::npos; slash = path.find('/', slash + 1)) {
    const std::string folder = path.substr(0, slash);
    if (!folders_.insert(folder).second) continue;
    RETURN_IF_ERROR(make_folder(absl::StrCat(partial_, "/", folder)));
  }
  return absl::OkStatus();
}

absl::Status PartialDirectory::open_file(const std::string& path) {
  LOCUS_CHECK(made_);
  LOCUS_CHECK(file_ < 0);
  RETURN_IF_ERROR(make_folders_of(path));
  file_path_ = absl::StrCat(partial_, "/", path);
  file_ = open(file_path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kFileMode);
  return file_ >= 0 ? absl::OkStatus() : file_error("make", file_path_, errno);
}

absl::Status PartialDirectory::write(absl::string_view bytes) {
  LOCUS_CHECK(file_ >= 0);
  while (!bytes.empty()) {
    const ssize_t some = ::write(file_, bytes.data(), bytes.size());
    if (some < 0 && errno == EINTR) continue;
    if (some < 0) return file_error("write", file_path_, errno);
    bytes.remove_prefix(static_cast<size_t>(some));
  }
  return absl::OkStatus();
}

absl::Status PartialDirectory::close_file() {
  LOCUS_CHECK(file_ >= 0);
  const int failed = fsync(file_) == 0 ? 0 : errno;
  close(file_);
  file_ = -1;
  return failed == 0 ? absl::OkStatus() : file_error("sync", file_path_, failed);
}

absl::Status PartialDirectory::keep() {
  LOCUS_CHECK(made_);
  LOCUS_CHECK(file_ < 0);
  for (const std::string& folder : folders_) {
    RETURN_IF_ERROR(sync_folder(absl::StrCat(partial_, "/", folder)));
  }
  RETURN_IF_ERROR(sync_folder(partial_));
  // rename() replaces an empty directory at the target, and fails if anything else exists there.
  if (std::rename(partial_.c_str(), target_.c_str()) != 0) return file_error("make", target_, errno);
  made_ = false;
  return sync_folder(fs::path(target_).parent_path().string());
}

}  // namespace locus::cli
