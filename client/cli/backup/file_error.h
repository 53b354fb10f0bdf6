// What commands that read and write files of backups say when the system refuses something. A function without state.
#ifndef LOCUS_CLIENT_CLI_BACKUP_FILE_ERROR_H_
#define LOCUS_CLIENT_CLI_BACKUP_FILE_ERROR_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// "cannot DOING PATH: ...", with what to do where that is known. `error` is an errno: NOT_FOUND where something is not
// there, RESOURCE_EXHAUSTED for a full disk, else FAILED_PRECONDITION: a file that may not be read is not the server's
// denial.
absl::Status file_error(absl::string_view doing, const std::string& path, int error);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_FILE_ERROR_H_
