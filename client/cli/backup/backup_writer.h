// Writer of a server's backup to a directory. Adds the file SHA256SUMS with the checksums of all files. For `locus
// backup`. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_BACKUP_BACKUP_WRITER_H_
#define LOCUS_CLIENT_CLI_BACKUP_BACKUP_WRITER_H_

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/cli/backup/checksums.h"
#include "client/cli/backup/partial_directory.h"
#include "client/lib/backup.h"

namespace locus::cli {

// Callback for progress; receives the number of bytes processed so far and the total number of bytes.
using BackupProgress = std::function<void(uint64_t done, uint64_t total)>;

class BackupWriter final : public client::BackupSink {
 public:
  // Borrows `directory`. Precondition: directory.make() has not been called yet, because begin() calls it.
  BackupWriter(PartialDirectory& directory, BackupProgress progress);

  absl::Status begin(const client::BackupSize& announced) override;
  absl::Status begin_file(const std::string& path) override;
  absl::Status add(absl::string_view bytes) override;
  absl::Status end_file(const client::BackupFile& file) override;

  // Adds SHA256SUMS and renames the directory to its final name. Precondition: end_file() was called for the last file.
  absl::Status finish();

 private:
  PartialDirectory& directory_;
  const BackupProgress progress_;
  client::BackupSize announced_;
  uint64_t received_ = 0;
  std::vector<Checksum> checksums_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_BACKUP_WRITER_H_
