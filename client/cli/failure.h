// Errors on the command line: exit codes for scripts, error lines, and hints that suggest the next step. Functions
// without state.
#ifndef LOCUS_CLIENT_CLI_FAILURE_H_
#define LOCUS_CLIENT_CLI_FAILURE_H_

#include <ostream>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/cli/output.h"
#include "client/lib/client.h"

namespace locus::cli {

enum class ExitCode { kOk = 0, kFailed = 1, kUsage = 2, kUnreachable = 3, kDenied = 4, kNotFound = 5 };

// Returns a usage error, with exit code kUsage, for a command line that the parser accepted but whose values or options
// do not fit together.
absl::Status usage_error(absl::string_view message);

// Marks an error as already printed. run_line() then does not print it again, but the exit code still depends on it.
absl::Status reported(absl::Status status);
bool is_reported(const absl::Status& status);

// Returns the name of an error: USAGE for a usage error, else the server's reason without "REASON_", or the status
// code's name if the server gave no reason.
std::string failure_name(const absl::Status& status);
// Returns whether failure_name() can return `name`.
bool is_failure_name(const std::string& name);

// Returns `status` with "PLACE: " prepended to its message; code and payloads are kept.
absl::Status with_place(const absl::Status& status, absl::string_view place);

ExitCode exit_code_of(const absl::Status& status);

// Choice whether a failure is written with its hint.
enum class Hints { kShown, kHidden };

// Writes a line "error: ..." and, if there is a hint, a line "hint: ...". With json and ndjson, writes one object on
// one line instead: {"error": {"code", "message", "reason", "field", "index", "limit", "hint"}}. Keys without a value
// are omitted.
void write_failure(std::ostream& err, Format format, const absl::Status& status, Hints hints = Hints::kShown);

// Returns OK if the server refused no item of the batch. Otherwise returns an error that contains the number of refused
// items and the reason of the first one. The code is NOT_FOUND if every refused item that the ack lists has an unknown
// id, and FAILED_PRECONDITION otherwise.
absl::Status refused_items(const v1::UpdateAck& ack);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_FAILURE_H_
