// Parsed `expect` line: `EXPR OP EXPR`, with OP one of == != < <= > >= contains, optionally followed by
// `within TOLERANCE` after ==. For the runner of scripts. Functions without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_EXPECTATION_H_
#define LOCUS_CLIENT_CLI_SCRIPT_EXPECTATION_H_

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/script/value.h"
#include "client/cli/script/variables.h"

namespace locus::cli {

struct Expectation {
  std::string text;  // as written, without comment
  Value left;
  std::string comparison;
  Value right;
  std::string right_text;
  std::optional<Value> tolerance;
};

// INVALID_ARGUMENT for a wrong form, the errors of expressions for their values.
absl::StatusOr<Expectation> read_expectation(absl::string_view text, const Variables& variables);

// FAILED_PRECONDITION saying what was expected and what the left side is. Ids compare exactly; texts that read as
// numbers compare as numbers; a column of several rows compares as a list. Every value must be known.
absl::Status judge(const Expectation& expectation);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_EXPECTATION_H_
