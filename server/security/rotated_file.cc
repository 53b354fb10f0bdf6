#include "server/security/rotated_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

constexpr mode_t kPrivate = 0600;

}  // namespace

absl::StatusOr<std::unique_ptr<RotatedFile>> RotatedFile::open(const std::string& file, uint64_t max_bytes,
                                                               uint32_t files) {
  std::unique_ptr<RotatedFile> rotated(new RotatedFile(file, max_bytes, files));
  RETURN_IF_ERROR(rotated->reopen());
  return rotated;
}

RotatedFile::~RotatedFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

absl::Status RotatedFile::reopen() {
  const int opened = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, kPrivate);
  if (opened < 0) return absl::ErrnoToStatus(errno, absl::StrCat("cannot open ", file_));
  struct stat status;
  absl::Status result;
  if (::fstat(opened, &status) != 0 || !S_ISREG(status.st_mode)) {
    result = refuse_argument(Reason::kMalformed, file_, {}, "is no regular file");
  } else if (::fchmod(opened, kPrivate) != 0) {
    result = absl::ErrnoToStatus(errno, absl::StrCat("cannot make private ", file_));
  }
  if (!result.ok()) {
    ::close(opened);
    return result;
  }
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = opened;
  size_ = static_cast<uint64_t>(status.st_size);
  return absl::OkStatus();
}

void RotatedFile::rename_all() const {
  for (uint32_t number = files_ - 1; number > 0; --number) {
    const std::string older = number == 1 ? file_ : absl::StrCat(file_, ".", number - 1);
    ::rename(older.c_str(), absl::StrCat(file_, ".", number).c_str());  // `older` may not exist yet
  }
}

absl::Status RotatedFile::append(absl::string_view line) {
  if (size_ > 0 && size_ + line.size() > max_bytes_) {
    rename_all();
    RETURN_IF_ERROR(reopen());
  }
  absl::string_view rest = line;
  while (!rest.empty()) {
    const ssize_t count = ::write(descriptor_, rest.data(), rest.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const absl::Status status = absl::ErrnoToStatus(errno, absl::StrCat("cannot write ", file_));
      // Cut off a partly written line, so that the next line is not appended to it. If truncating the file fails, the
      // file has one malformed line.
      if (rest.size() < line.size() && ::ftruncate(descriptor_, static_cast<off_t>(size_)) != 0) size_ += line.size();
      return status;
    }
    rest.remove_prefix(static_cast<size_t>(count));
  }
  size_ += line.size();
  return absl::OkStatus();
}

}  // namespace locus::server
