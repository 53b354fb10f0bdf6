#include "server/security/text_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/security/security_limits.h"

namespace locus::server {
namespace {

constexpr size_t kMaxQuotedBytes = 64;  // bytes of a word that an error repeats

// Open file, closed when destroyed.
class OpenFile {
 public:
  explicit OpenFile(int descriptor) : descriptor_(descriptor) {}
  ~OpenFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

absl::Status system_error(absl::string_view what, const std::string& file) {
  return absl::ErrnoToStatus(errno, absl::StrCat("cannot ", what, " ", file));
}

// Reads up to kMaxSecurityFileBytes + 1 bytes.
absl::StatusOr<std::string> read_all(int descriptor, const std::string& file) {
  std::string text(kMaxSecurityFileBytes + 1, '\0');
  size_t size = 0;
  while (size < text.size()) {
    const ssize_t count = ::read(descriptor, text.data() + size, text.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return system_error("read", file);
    if (count == 0) break;
    size += static_cast<size_t>(count);
  }
  text.resize(size);
  return text;
}

absl::Status write_and_sync(int descriptor, const std::string& file, absl::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(descriptor, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return system_error("write", file);
    text.remove_prefix(static_cast<size_t>(count));
  }
  if (::fsync(descriptor) != 0) return system_error("sync", file);
  return absl::OkStatus();
}

absl::Status sync_folder(const std::string& file) {
  const size_t slash = file.rfind('/');
  const std::string folder(slash == std::string::npos ? absl::string_view(".")
                                                      : absl::string_view(file).substr(0, slash + 1));
  const OpenFile opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.get() < 0) return system_error("open", folder);
  if (::fsync(opened.get()) != 0) return system_error("sync", folder);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TextFile> read_text_file(const std::string& file) {
  // O_NONBLOCK, because opening a pipe would block otherwise.
  const OpenFile opened(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (opened.get() < 0) return system_error("open", file);
  struct stat status;
  if (::fstat(opened.get(), &status) != 0) return system_error("stat", file);
  if (!S_ISREG(status.st_mode)) return refuse_argument(Reason::kMalformed, file, {}, "is no regular file");
  if ((status.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    return absl::FailedPreconditionError(
        absl::StrCat(file, ": its group or others can write it, and so give themselves rights; chmod go-w ", file));
  TextFile read;
  read.mode = status.st_mode & 07777;
  ASSIGN_OR_RETURN(read.text, read_all(opened.get(), file));
  if (read.text.size() > kMaxSecurityFileBytes)
    return refuse_argument(Reason::kLimit, file, {},
                           absl::StrCat("is larger than ", kMaxSecurityFileBytes, " bytes; remove lines"));
  return read;
}

absl::Status replace_text_file(const std::string& file, absl::string_view text, mode_t mode) {
  std::string temporary = absl::StrCat(file, ".XXXXXX");
  const OpenFile opened(::mkostemp(temporary.data(), O_CLOEXEC));
  if (opened.get() < 0) return system_error("create", temporary);
  absl::Status status = ::fchmod(opened.get(), mode) == 0 ? absl::OkStatus() : system_error("chmod", temporary);
  if (status.ok()) status = write_and_sync(opened.get(), temporary, text);
  if (status.ok() && ::rename(temporary.c_str(), file.c_str()) != 0) status = system_error("replace", file);
  if (!status.ok()) {
    ::unlink(temporary.c_str());
    return status;
  }
  return sync_folder(file);
}

absl::Status refuse_line(absl::string_view file, size_t line, absl::string_view message) {
  return refuse_argument(Reason::kMalformed, absl::StrCat(file, ":", line), {}, message);
}

std::string quoted_word(absl::string_view word) {
  return absl::StrCat("`", absl::CHexEscape(word.substr(0, kMaxQuotedBytes)),
                      word.size() > kMaxQuotedBytes ? "..." : "", "`");
}

}  // namespace locus::server
