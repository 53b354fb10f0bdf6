// What the command line does about failures: an exit code for scripts, and words that say what to do next. Functions
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

// A mistake in how the command was written, found after parsing; exits with kUsage.
absl::Status usage_error(absl::string_view message);

// Marks a failure that was written already: it still decides the exit code.
absl::Status told(absl::Status status);
bool is_told(const absl::Status& status);

// One word for a failure: USAGE, the server's reason without "REASON_", or the name of the status code where the server
// gave none.
std::string failure_name(const absl::Status& status);
// Whether any failure has this name.
bool is_failure_name(const std::string& name);

// The same failure with `place: ` before its message.
absl::Status with_place(const absl::Status& status, absl::string_view place);

ExitCode exit_code_of(const absl::Status& status);

// One line "error: ..." and one line "hint: ..." where there is one; with json and ndjson instead one object on one
// line: {"error": {"code", "message", "reason", "field", "index", "hint"}}, absent parts left out.
void write_failure(std::ostream& err, Format format, const absl::Status& status);

// OK if the ack refused nothing. Otherwise says how many items were refused and why the first was: NOT_FOUND if all
// listed were unknown ids, else FAILED_PRECONDITION.
absl::Status refused_items(const v1::UpdateAck& ack);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_FAILURE_H_
