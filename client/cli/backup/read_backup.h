// Verification of a backup against its SHA256SUMS, with an optional copy. For `locus restore`. Functions without state.
#ifndef LOCUS_CLIENT_CLI_BACKUP_READ_BACKUP_H_
#define LOCUS_CLIENT_CLI_BACKUP_READ_BACKUP_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/backup/backup_writer.h"
#include "client/cli/backup/partial_directory.h"
#include "client/lib/backup.h"

namespace locus::cli {

// Reads every file of the directory `backup` once and verifies its hash. If `copy` is not null, calls copy->make() and
// writes all files except SHA256SUMS to `copy`; the caller calls copy->keep() afterwards. Returns DATA_LOSS if files
// are missing, changed or not listed in SHA256SUMS; the message names the first few of these files. If `copy` is not
// null, reads no file if a file is missing or not listed, and stops at the first changed file. Returns NOT_FOUND if
// there is no backup.
absl::StatusOr<client::BackupSize> read_backup(const std::string& backup, PartialDirectory* copy,
                                               const BackupProgress& progress);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_READ_BACKUP_H_
