// Directory that appears either complete or not at all. The directory is created and filled as TARGET.partial, and
// renamed to TARGET after all its files were synced to disk. For backups and restored data directories. Not
// thread-safe. This header also declares file_error(), which makes the errors of file operations in client/cli/backup.
//
// Invariant: TARGET does not change before keep(). The destructor removes TARGET.partial unless keep() has renamed it;
// a process that is killed leaves TARGET.partial behind.
#ifndef LOCUS_CLIENT_CLI_BACKUP_PARTIAL_DIRECTORY_H_
#define LOCUS_CLIENT_CLI_BACKUP_PARTIAL_DIRECTORY_H_

#include <cstdint>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Returns the error "cannot DOING PATH: ...", with advice for common causes. `error` is the errno of the failed call.
// The code is NOT_FOUND for ENOENT, RESOURCE_EXHAUSTED for a full disk or an exceeded disk quota, and
// FAILED_PRECONDITION for any other errno. Missing file permissions do not give PERMISSION_DENIED, because that code is
// reserved for denials by the server.
absl::Status file_error(absl::string_view doing, const std::string& path, int error);

// Condition that the target must satisfy before the directory is made. kNothing: the target does not exist.
// kNothingOrEmpty: the target does not exist, or is an empty directory.
enum class TargetRule { kNothing, kNothingOrEmpty };

class PartialDirectory {
 public:
  // Stores the arguments; does not access the file system.
  PartialDirectory(const std::string& target, TargetRule rule);
  ~PartialDirectory();
  PartialDirectory(const PartialDirectory&) = delete;
  PartialDirectory& operator=(const PartialDirectory&) = delete;

  // Return the absolute paths of TARGET and TARGET.partial.
  const std::string& target() const { return target_; }
  const std::string& partial() const { return partial_; }

  // Returns FAILED_PRECONDITION if the target does not satisfy the rule, or if TARGET.partial exists.
  absl::Status check() const;
  // Calls check() and creates TARGET.partial, accessible to its owner only. Returns RESOURCE_EXHAUSTED if less than
  // `bytes` bytes are free on the disk.
  absl::Status make(uint64_t bytes);

  // Creates the file `path` and its parent folders, and opens it for write(). Only one file is open at a time. `path`
  // must be relative, valid (BackupPaths in client/lib/backup.h) and not created before. close_file() syncs the file to
  // disk.
  absl::Status open_file(const std::string& path);
  absl::Status write(absl::string_view bytes);
  absl::Status close_file();

  // Completes the directory: syncs its folders to disk and renames TARGET.partial to TARGET. After that the destructor
  // removes nothing. Preconditions: make() succeeded, and no file is open.
  absl::Status keep();

 private:
  absl::Status make_folders_of(const std::string& path);

  const std::string target_;
  const std::string partial_;
  const TargetRule rule_;
  bool made_ = false;
  std::set<std::string> folders_;  // folders created by open_file(), relative paths
  int file_ = -1;                  // descriptor of the open file; -1 = none
  std::string file_path_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_PARTIAL_DIRECTORY_H_
