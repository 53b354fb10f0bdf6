#include "server/services/backup.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "locus/v1/server_service.pb.h"
#include "server/observability/log.h"
#include "server/scheduling/thread_priority.h"
#include "server/services/scene_access.h"
#include "server/services/sha256.h"

namespace locus::server {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kBackupRetryMs = 5000;
// Name of the copy's directory inside kBackupDirectory. The directory kBackupDirectory is used for nothing else, so it
// is removed as a whole, with any files that the log has left there beside the copy.
constexpr const char* kCopy = "copy";
// Upper bound of the memory of a backup, as a multiple of limits::kBackupPieceBytes. A piece's message and its
// serialized bytes exist at the same time; the rest is a margin.
constexpr uint64_t kCopies = 4;

// Function that writes a piece to the caller; returns false to end the backup.
using TakeBackupPiece = std::function<bool(const v1::BackupResponse&)>;

struct File {
  std::string path;  // relative to the copy's directory
  uint64_t bytes = 0;
};

fs::path directory_of(const Host& host) { return fs::path(host.config.data_dir) / kBackupDirectory; }

absl::Status unreadable(absl::string_view path, absl::string_view why) {
  return absl::DataLossError(absl::StrCat("the copy's file ", path, " cannot be read: ", why,
                                          "; check the server's disk, and its data with `locusd check`"));
}

// Returns the status for a directory that could not be created: RESOURCE_EXHAUSTED if the disk is full, otherwise
// UNAVAILABLE.
absl::Status not_made(const fs::path& path, const std::error_code& why) {
  const bool full = why == std::errc::no_space_on_device;
  return absl::Status(full ? absl::StatusCode::kResourceExhausted : absl::StatusCode::kUnavailable,
                      absl::StrCat("cannot make ", path.string(), ": ", why.message(),
                                   full ? "; free some of the server's disk" : "; check the server's disk"));
}

// Removes the directory with its contents. Logs a warning if that fails.
void remove_tree(const fs::path& directory) {
  std::error_code why;
  fs::remove_all(directory, why);
  if (!why) return;
  log(LogLevel::kWarning, "cannot remove the copy of a backup, so replaced files still occupy disk space",
      {{"path", directory.string()}, {"text", why.message()}, {"hint", "remove it by hand"}});
}

// A directory that is empty after make() and removed by the destructor.
class Directory {
 public:
  explicit Directory(fs::path path) : path_(std::move(path)) {}
  ~Directory() { remove_tree(path_); }
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;

  absl::Status make() const {
    remove_tree(path_);
    std::error_code why;
    return fs::create_directory(path_, why) || !why ? absl::OkStatus() : not_made(path_, why);
  }

 private:
  const fs::path path_;
};

// Returns every file below `copy`, in ascending order of paths.
absl::StatusOr<std::vector<File>> list_files(const fs::path& copy) {
  std::vector<File> files;
  std::error_code why;
  fs::recursive_directory_iterator entry(copy, why);
  for (const fs::recursive_directory_iterator end; !why && entry != end; entry.increment(why)) {
    const std::string path = entry->path().lexically_relative(copy).generic_string();
    const fs::file_status status = entry->symlink_status(why);
    if (why) return unreadable(path, why.message());
    if (fs::is_directory(status)) continue;
    if (!fs::is_regular_file(status)) return unreadable(path, "it is no regular file");
    files.push_back({path, entry->file_size(why)});
    if (why) return unreadable(path, why.message());
    if (files.size() > limits::kMaxBackupFiles)
      return refuse_full("", "backup_files", limits::kMaxBackupFiles, limits::kMaxBackupFiles + 1.0, 0);
  }
  if (why) return unreadable(copy.string(), why.message());
  std::sort(files.begin(), files.end(), [](const File& a, const File& b) { return a.path < b.path; });
  return files;
}

class OpenFile {
 public:
  explicit OpenFile(const fs::path& path) : descriptor_(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~OpenFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  bool is_open() const { return descriptor_ >= 0; }

  // Returns the number of bytes read, which is less than `bytes` only at the end of the file; -1 and errno on error.
  ssize_t read(char* to, size_t bytes) const {
    size_t done = 0;
    while (done < bytes) {
      const ssize_t some = ::read(descriptor_, to + done, bytes - done);
      if (some < 0 && errno == EINTR) continue;
      if (some < 0) return some;
      if (some == 0) break;
      done += static_cast<size_t>(some);
    }
    return static_cast<ssize_t>(done);
  }

 private:
  const int descriptor_;
};

// Sends as many bytes of the file as list_files() reported. Returns false if `take` ended the backup.
absl::StatusOr<bool> send_file(const fs::path& copy, const File& file, const TakeBackupPiece& take) {
  const OpenFile from(copy / file.path);
  if (!from.is_open()) return unreadable(file.path, std::strerror(errno));
  Sha256Hasher hasher;
  v1::BackupResponse piece;
  piece.set_path(file.path);
  uint64_t left = file.bytes;
  while (true) {
    std::string& data = *piece.mutable_data();
    data.resize(std::min<uint64_t>(left, limits::kBackupPieceBytes));
    const ssize_t got = from.read(data.data(), data.size());
    if (got < 0) return unreadable(file.path, std::strerror(errno));
    if (static_cast<size_t>(got) < data.size()) return unreadable(file.path, "it became shorter meanwhile");
    hasher.add(data.data(), data.size());
    left -= data.size();
    if (left == 0) break;
    if (!take(piece)) return false;
    piece.clear_path();
  }
  ASSIGN_OR_RETURN(const Sha256 sha256, hasher.finish());
  piece.mutable_end()->set_bytes(file.bytes);
  piece.mutable_end()->set_sha256(sha256.data(), sha256.size());
  return take(piece);
}

absl::StatusOr<bool> send_copy(const fs::path& copy, const TakeBackupPiece& take) {
  ASSIGN_OR_RETURN(const std::vector<File> files, list_files(copy));
  v1::BackupResponse first;
  first.mutable_announced()->set_files(static_cast<uint32_t>(files.size()));
  uint64_t bytes = 0;
  for (const File& file : files) bytes += file.bytes;
  first.mutable_announced()->set_bytes(bytes);
  if (!take(first)) return false;
  for (const File& file : files) {
    absl::StatusOr<bool> sent = send_file(copy, file, take);
    if (!sent.ok() || !*sent) return sent;
  }
  return true;
}

absl::Status no_data_directory() {
  Refusal refusal;
  refusal.reason = Reason::kNotServed;
  return refuse(absl::StatusCode::kUnimplemented,
                "this server keeps scenes in memory only, so there is nothing to copy; `locus dump` and `locus export` "
                "save a scene, and a server started with --data-dir can be backed up",
                refusal);
}

}  // namespace

bool can_back_up(const Host& host) { return host.log != nullptr && !host.config.data_dir.empty(); }

void remove_leftover_backup(const Host& host) { remove_tree(directory_of(host)); }

absl::Status back_up(Host& host, const Caller& caller, MessageStream& stream) {
  if (!can_back_up(host)) return no_data_directory();
  const AdmissionLimiter::Permit permit = host.backups.enter();
  if (!permit) return refuse_full("", "backups", host.backups.max(), host.backups.max() + 1.0, kBackupRetryMs);
  ASSIGN_OR_RETURN(const CallMemory claim,
                   claim_copy(caller, kCopies * limits::kBackupPieceBytes, MemoryLine::kBackups));
  const fs::path path = directory_of(host);
  const Directory directory(path);
  RETURN_IF_ERROR(directory.make());
  RETURN_IF_ERROR(host.log->back_up((path / kCopy).string()));
  const TakeBackupPiece take = [&](const v1::BackupResponse& piece) {
    return caller.stop().ok() && stream.write(piece);
  };
  absl::StatusOr<bool> sent = false;
  std::thread([&] {
    take_batch_priority(host.config.batch_priority);
    sent = send_copy(path / kCopy, take);
  }).join();
  RETURN_IF_ERROR(sent.status());
  if (*sent) return absl::OkStatus();
  const absl::Status status = caller.stop();
  return status.ok() ? absl::CancelledError("the caller stopped reading") : status;
}

}  // namespace locus::server
