// Errors of file operations, for commands that read and write backups. A function without state.
#ifndef LOCUS_CLIENT_CLI_BACKUP_FILE_ERROR_H_
#define LOCUS_CLIENT_CLI_BACKUP_FILE_ERROR_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Returns the error "cannot DOING PATH: ...", with advice for common causes. `error` is the errno of the failed call.
// The code is NOT_FOUND for ENOENT, RESOURCE_EXHAUSTED for a full disk, else FAILED_PRECONDITION. Missing file
// permissions are not PERMISSION_DENIED, because that code is reserved for denials by the server.
absl::Status file_error(absl::string_view doing, const std::string& path, int error);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_FILE_ERROR_H_
