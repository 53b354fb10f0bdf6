// What receives a server's backup, file by file, and which paths its files may have. For callers of Client::backup and
// for whoever reads a backup again. Paths are checked because they end in somebody's file system: a server that lies
// writes nowhere else.
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

struct BackupSize {
  uint64_t files = 0;
  uint64_t bytes = 0;
};

// A file whose bytes are what the server hashed.
struct BackupFile {
  std::string path;
  uint64_t bytes = 0;
  Sha256 sha256 = {};
};

// Called from the thread that called Client::backup: begin() once, then for each file begin_file(), add() any number of
// times and end_file(). A status that is not OK ends the backup with it. What came is a backup only once Client::backup
// returned OK.
class BackupSink {
 public:
  virtual ~BackupSink() = default;

  // What will come in all.
  virtual absl::Status begin(const BackupSize& announced) = 0;
  // `path` is fit for a file of a directory of its own; no file comes twice, nor stands where another has a folder.
  virtual absl::Status begin_file(const std::string& path) = 0;
  virtual absl::Status add(absl::string_view bytes) = 0;
  // Its bytes are proven.
  virtual absl::Status end_file(const BackupFile& file) = 0;
};

// The paths of one backup, each checked against those before. Not thread-safe.
class BackupPaths {
 public:
  // INVALID_ARGUMENT, in words that follow the path, for a path that is empty, too long, or not made of names with
  // single slashes between them, for a name that is `.` or `..`, for `\` and what is not printable, for a path that was
  // there before, for one that is a folder of another or the other way round, and for one too many.
  absl::Status add(const std::string& path);

 private:
  std::set<std::string> files_;
  std::set<std::string> folders_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_BACKUP_H_
