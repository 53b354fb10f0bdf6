// Receiver of a server's backup, file by file, and the check of the paths of its files. For callers of Client::backup
// and for tools that read a stored backup. Paths are checked because the receiver uses them in a file system: a
// malicious server must not be able to write outside the backup's directory.
#ifndef LOCUS_CLIENT_LIB_BACKUP_H_
#define LOCUS_CLIENT_LIB_BACKUP_H_

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/lib/sha256.h"

namespace locus::client {

inline constexpr size_t kMaxBackupFiles = size_t{1} << 20;
inline constexpr size_t kMaxBackupPathLength = 1024;

// Number of files and bytes of a backup.
struct BackupSize {
  uint64_t files = 0;
  uint64_t bytes = 0;
};

// File whose bytes have the SHA-256 that the server sent.
struct BackupFile {
  std::string path;
  uint64_t bytes = 0;
  Sha256 sha256 = {};
};

// Receiver of the files. Called in the thread that called Client::backup: begin() once, then for each file
// begin_file(), add() any number of times, and end_file(). A status that is not OK ends the backup with that status.
// The received files are a complete backup only after Client::backup has returned OK.
class BackupSink {
 public:
  virtual ~BackupSink() = default;

  // Begins the backup; `announced` is its total size.
  virtual absl::Status begin(const BackupSize& announced) = 0;
  // Begins a file. `path` has passed BackupPaths::add(): it is relative, unique, and no folder of another file.
  virtual absl::Status begin_file(const std::string& path) = 0;
  // Appends bytes to the current file.
  virtual absl::Status add(absl::string_view bytes) = 0;
  // Ends the current file, whose size and SHA-256 have been verified.
  virtual absl::Status end_file(const BackupFile& file) = 0;
};

// Paths of one backup. Not thread-safe. Invariant: no file of files_ is also in folders_.
class BackupPaths {
 public:
  // Adds a path. Returns INVALID_ARGUMENT, with a message that continues a sentence about the path, if the path is
  // empty, too long, or not made of names separated by single slashes; if a name is `.` or `..`; if it contains `\` or
  // a control character; if it was added before, is a folder of another path, or has another path as its folder; or if
  // there are too many paths.
  absl::Status add(const std::string& path);

 private:
  std::set<std::string> files_;
  std::set<std::string> folders_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_BACKUP_H_
