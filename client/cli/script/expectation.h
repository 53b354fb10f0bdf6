// Parsed `expect` line: `EXPR OP EXPR`, with OP one of == != < <= > >= contains. If OP is ==, `within TOLERANCE` may
// follow. For the runner of scripts. Functions without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_EXPECTATION_H_
#define LOCUS_CLIENT_CLI_SCRIPT_EXPECTATION_H_

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/script/value.h"
#include "client/cli/script/variables.h"

namespace locus::cli {

// NOLINTNEXTLINE(bugprone-exception-escape): the move constructor of Json is noexcept; it contains an assertion
struct Expectation {
  std::string text;  // text as written, without the comment
  Value left;
  std::string comparison;
  Value right;
  std::string right_text;
  std::optional<Value> tolerance;
};

// Parses an `expect` line. Returns INVALID_ARGUMENT for a line of another form, and the errors of its expressions.
absl::StatusOr<Expectation> read_expectation(absl::string_view text, const Variables& variables);

// Checks the expectation. Returns FAILED_PRECONDITION with the expected and the actual value if it is not met. Ids
// compare exactly; texts that are numbers compare as numbers; a column of several rows compares as a list.
// Precondition: no value is unknown.
absl::Status verify(const Expectation& expectation);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_EXPECTATION_H_
