// A directory that comes into being whole or not at all: made and filled as TARGET.partial, and renamed to TARGET once
// everything in it is on the disk. For backups and for what is restored from them. Not thread-safe.
//
// Invariant: nothing stands under the target's name before keep() returned OK. What is not kept is removed with the
// object; a process that is killed leaves TARGET.partial behind.
#ifndef LOCUS_CLIENT_CLI_BACKUP_PARTIAL_DIRECTORY_H_
#define LOCUS_CLIENT_CLI_BACKUP_PARTIAL_DIRECTORY_H_

#include <cstdint>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// What may stand under the target's name.
enum class TargetRule { kNothing, kNothingOrEmpty };

class PartialDirectory {
 public:
  // Touches nothing yet.
  PartialDirectory(const std::string& target, TargetRule rule);
  ~PartialDirectory();
  PartialDirectory(const PartialDirectory&) = delete;
  PartialDirectory& operator=(const PartialDirectory&) = delete;

  // Both absolute.
  const std::string& target() const { return target_; }
  const std::string& partial() const { return partial_; }

  // FAILED_PRECONDITION where the rule is broken or TARGET.partial is there.
  absl::Status check() const;
  // Checks, and makes TARGET.partial for its owner alone. RESOURCE_EXHAUSTED where its disk has no room for `bytes`.
  absl::Status make(uint64_t bytes);

  // One file after another: a new file at `path`, which is relative, fit (client/lib/backup.h) and new; its folders are
  // made. On the disk after close_file().
  absl::Status open_file(const std::string& path);
  absl::Status write(absl::string_view bytes);
  absl::Status close_file();

  // Gives the directory its name. Before this, every file is closed.
  absl::Status keep();

 private:
  absl::Status make_folders_of(const std::string& path);

  const std::string target_;
  const std::string partial_;
  const TargetRule rule_;
  bool made_ = false;
  std::set<std::string> folders_;  // that were made, relative
  int file_ = -1;                  // the open one
  std::string file_path_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_PARTIAL_DIRECTORY_H_
