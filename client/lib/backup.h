// Interface of a receiver of a server's backup, and validation of the paths of the backup's files. For callers of
// Client::backup and for tools that read a stored backup. Paths are validated because receivers create files at them: a
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

// Size of a backup: number of its files, and total number of their bytes.
struct BackupSize {
  uint64_t files = 0;
  uint64_t bytes = 0;
};

// File of a backup that was received completely: its path, its size in bytes, and its SHA-256, which was verified to
// equal the SHA-256 that the server sent.
struct BackupFile {
  std::string path;
  uint64_t bytes = 0;
  Sha256 sha256 = {};
};

// Receiver of the files of a backup, implemented by the caller of Client::backup. Client::backup calls these functions
// in its caller's thread: begin() once, then for each file begin_file(), add() any number of times, and end_file(). If
// a function returns a status that is not OK, the backup ends with that status. The received files are a complete
// backup only after Client::backup has returned OK.
class BackupSink {
 public:
  virtual ~BackupSink() = default;

  // Begins the backup. `announced` is the size that the whole backup will have.
  virtual absl::Status begin(const BackupSize& announced) = 0;
  // Begins a file. `path` was accepted by BackupPaths::add(): it is relative, differs from the paths of all earlier
  // files, and is neither a folder of an earlier file nor inside an earlier file.
  virtual absl::Status begin_file(const std::string& path) = 0;
  // Appends `bytes` to the current file.
  virtual absl::Status add(absl::string_view bytes) = 0;
  // Ends the current file, whose size and SHA-256 have been verified.
  virtual absl::Status end_file(const BackupFile& file) = 0;
};

// Set of the validated file paths of one backup. Not thread-safe. Invariant: no path is both in files_ and in folders_.
class BackupPaths {
 public:
  // Validates `path` and adds it to the set. Returns INVALID_ARGUMENT in these cases: the path is empty, longer than
  // kMaxBackupPathLength, or not made of names separated by single slashes; a name is `.` or `..`; the path contains
  // `\` or a control character; the path was added before, is a folder of another path, or has another path as its
  // folder; there are too many files or folders. The error message is a predicate such as "is empty", so callers
  // prepend the path.
  absl::Status add(const std::string& path);

 private:
  // Returns whether the invariant of the class comment holds for `path` and the folders that contain it.
  bool check_invariants(const std::string& path) const;

  std::set<std::string> files_;
  std::set<std::string> folders_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_BACKUP_H_
