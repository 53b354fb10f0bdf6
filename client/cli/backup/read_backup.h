// Reads a backup and proves it by its SHA256SUMS, and copies it where a copy is wanted. For `locus restore`. Functions
// without state.
#ifndef LOCUS_CLIENT_CLI_BACKUP_READ_BACKUP_H_
#define LOCUS_CLIENT_CLI_BACKUP_READ_BACKUP_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/backup/backup_writer.h"
#include "client/cli/backup/partial_directory.h"
#include "client/lib/backup.h"

namespace locus::cli {

// Reads every file of the directory `backup`, once; with `copy`, which was not made yet, writes it there as well, all
// but SHA256SUMS, and leaves it to the caller to keep. DATA_LOSS naming the first few files that are missing, have
// other bytes, or are there without being listed; a copy ends at the first of them. NOT_FOUND where there is no backup.
absl::StatusOr<client::BackupSize> read_backup(const std::string& backup, PartialDirectory* copy,
                                               const BackupProgress& progress);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_READ_BACKUP_H_
