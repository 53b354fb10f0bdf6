// Verification of a backup against its SHA256SUMS, with an optional copy. For `locus restore`. Functions without state.
#ifndef LOCUS_CLIENT_CLI_BACKUP_READ_BACKUP_H_
#define LOCUS_CLIENT_CLI_BACKUP_READ_BACKUP_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/backup/backup_writer.h"
#include "client/cli/backup/partial_directory.h"
#include "client/lib/backup.h"

namespace locus::cli {

// Reads once every file that is listed in the SHA256SUMS of the directory `backup`, and verifies its hash. If `copy` is
// not null, calls copy->make() and writes these files to `copy`; the caller calls copy->keep() afterwards. Returns
// DATA_LOSS if files are missing, changed or not listed in SHA256SUMS; the message names the first few of these files.
// Without `copy`, all listed files are verified before DATA_LOSS is returned. With `copy`, no file is read if one is
// missing or not listed, and reading stops at the first changed file. Returns NOT_FOUND if `backup` has no SHA256SUMS.
absl::StatusOr<client::BackupSize> read_backup(const std::string& backup, PartialDirectory* copy,
                                               const BackupProgress& progress);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_READ_BACKUP_H_
