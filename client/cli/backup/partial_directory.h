// Directory that appears complete or not at all: it is created and filled as TARGET.partial, and renamed to TARGET when
// all its files are synced to disk. For backups and restored data directories. Not thread-safe.
//
// Invariant: TARGET does not change before keep(). The destructor removes TARGET.partial unless keep() renamed it; a
// process that is killed leaves it behind.
#ifndef LOCUS_CLIENT_CLI_BACKUP_PARTIAL_DIRECTORY_H_
#define LOCUS_CLIENT_CLI_BACKUP_PARTIAL_DIRECTORY_H_

#include <cstdint>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Choice of what may exist at the target: nothing, or nothing but an empty directory.
enum class TargetRule { kNothing, kNothingOrEmpty };

class PartialDirectory {
 public:
  // Stores the paths; does not access the file system.
  PartialDirectory(const std::string& target, TargetRule rule);
  ~PartialDirectory();
  PartialDirectory(const PartialDirectory&) = delete;
  PartialDirectory& operator=(const PartialDirectory&) = delete;

  // Return absolute paths.
  const std::string& target() const { return target_; }
  const std::string& partial() const { return partial_; }

  // Returns FAILED_PRECONDITION if the target breaks the rule or TARGET.partial exists.
  absl::Status check() const;
  // Calls check() and creates TARGET.partial, accessible to its owner only. RESOURCE_EXHAUSTED if the disk has less
  // than `bytes` free bytes.
  absl::Status make(uint64_t bytes);

  // Creates the file `path` and its folders, and opens it for write(). Only one file is open at a time. `path` must be
  // relative, valid (BackupPaths in client/lib/backup.h) and new. The file is synced to disk by close_file().
  absl::Status open_file(const std::string& path);
  absl::Status write(absl::string_view bytes);
  absl::Status close_file();

  // Syncs the folders and renames the directory to the target. Precondition: no file is open.
  absl::Status keep();

 private:
  absl::Status make_folders_of(const std::string& path);

  const std::string target_;
  const std::string partial_;
  const TargetRule rule_;
  bool made_ = false;
  std::set<std::string> folders_;  // created folders, relative paths
  int file_ = -1;                  // descriptor of the open file; -1 = none
  std::string file_path_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_PARTIAL_DIRECTORY_H_
