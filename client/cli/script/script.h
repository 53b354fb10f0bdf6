// A script taken apart into statements, its blocks matched. For the runner. Plain data and a function without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_SCRIPT_H_
#define LOCUS_CLIENT_CLI_SCRIPT_SCRIPT_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

enum class Verb { kCommand, kLet, kUse, kBegin, kCommit, kRepeat, kEnd, kExpect, kEcho, kSleep };

struct Statement {
  Verb verb = Verb::kCommand;
  size_t line = 0;     // from 1
  std::string text;    // behind the verb; of a command all of it
  std::string reason;  // of `expect-error`: the name of the failure that its command or commit is to have
  size_t partner = 0;  // of begin, commit, repeat, end: the other end of the block
};

struct Script {
  std::string name;  // for messages
  std::vector<Statement> statements;
};

// Usage errors begin with name:line: blocks that are not closed or cross, a command that cannot stand in a batch, an
// unknown failure after expect-error, control characters, and whatever is over a limit of script_limits.h. What the
// statements hold is not read yet. Time linear in the text.
absl::StatusOr<Script> parse_script(const std::string& name, absl::string_view text);

// "name:line".
std::string place_of(const Script& script, const Statement& statement);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_SCRIPT_H_
