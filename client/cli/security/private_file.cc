#include "client/cli/security/private_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

// Returns the error of a failed system call, from errno. The code for missing file permissions is FAILED_PRECONDITION,
// because PERMISSION_DENIED is reserved for denials by the server.
absl::Status system_error(absl::string_view doing, const std::string& path) {
  const std::string message = absl::StrCat("cannot ", doing, " ", path, ": ", std::strerror(errno));
  if (errno == ENOENT) return absl::NotFoundError(message);
  return errno == EEXIST ? absl::AlreadyExistsError(message) : absl::FailedPreconditionError(message);
}

// Open file, closed when destroyed.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return number_; }

 private:
  const int number_;
};

// Sets the owner and the group of an open file to those of the file at `path`, if that file exists. This is needed when
// root replaces a file of another user: the user must still be able to read the file.
absl::Status keep_owner(int descriptor, const std::string& path) {
  struct stat old {
  }, made{};
  if (::stat(path.c_str(), &old) != 0) return errno == ENOENT ? absl::OkStatus() : system_error("look at", path);
  if (::fstat(descriptor, &made) != 0) return system_error("replace", path);
  if (old.st_uid == made.st_uid && old.st_gid == made.st_gid) return absl::OkStatus();
  if (::fchown(descriptor, old.st_uid, old.st_gid) == 0) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("cannot keep the owner of ", path, ": ", std::strerror(errno),
                                                    "; run this command as its owner or as root"));
}

absl::Status write_synced(int descriptor, const std::string& path, const SecurityFile& content) {
  if (::fchmod(descriptor, content.mode) != 0) return system_error("set the mode of", path);
  absl::string_view rest = content.text;
  while (!rest.empty()) {
    const ssize_t count = ::write(descriptor, rest.data(), rest.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return system_error("write", path);
    rest.remove_prefix(static_cast<size_t>(count));
  }
  return ::fsync(descriptor) == 0 ? absl::OkStatus() : system_error("sync", path);
}

absl::Status sync_parent(const std::string& path) {
  const std::string parent = std::filesystem::path(path).parent_path().string();
  const Descriptor folder(::open(parent.empty() ? "." : parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return folder.get() >= 0 && ::fsync(folder.get()) == 0 ? absl::OkStatus() : system_error("sync the folder of", path);
}

}  // namespace

absl::StatusOr<SecurityFile> read_security_file(const std::string& path) {
  // O_NONBLOCK: opening must not block if a named pipe has replaced the file.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0) return system_error("read", path);
  SecurityFile content{std::string(kMaxSecurityFileBytes + 1, '\0'), status.st_mode & 07777};
  size_t size = 0;
  while (size < content.text.size()) {
    const ssize_t count = ::read(file.get(), content.text.data() + size, content.text.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return system_error("read", path);
    if (count == 0) break;
    size += static_cast<size_t>(count);
  }
  if (size > kMaxSecurityFileBytes)
    return absl::FailedPreconditionError(absl::StrCat(path, " is larger than ", kMaxSecurityFileBytes, " bytes"));
  content.text.resize(size);
  return content;
}

absl::Status create_security_file(const std::string& path, const SecurityFile& content) {
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kPrivateMode));
  if (file.get() < 0) return system_error("make", path);
  const absl::Status written = write_synced(file.get(), path, content);
  if (!written.ok()) ::unlink(path.c_str());
  return written.ok() ? sync_parent(path) : written;
}

absl::Status replace_security_file(const std::string& path, const SecurityFile& content) {
  std::string temporary = absl::StrCat(path, ".XXXXXX");
  const Descriptor file(::mkostemp(temporary.data(), O_CLOEXEC));
  if (file.get() < 0) return system_error("make", temporary);
  absl::Status status = keep_owner(file.get(), path);
  if (status.ok()) status = write_synced(file.get(), temporary, content);
  if (status.ok() && ::rename(temporary.c_str(), path.c_str()) != 0) status = system_error("replace", path);
  if (status.ok()) return sync_parent(path);
  ::unlink(temporary.c_str());
  return status;
}

absl::StatusOr<FileLock> FileLock::acquire(const std::string& path) {
  const std::string name = absl::StrCat(path, ".lock");
  FileLock lock(::open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kPrivateMode));
  if (lock.descriptor_ < 0) return system_error("open", name);
  while (::flock(lock.descriptor_, LOCK_EX) != 0) {
    if (errno != EINTR) return system_error("lock", name);
  }
  return lock;
}

FileLock::FileLock(FileLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FileLock::~FileLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace locus::cli
