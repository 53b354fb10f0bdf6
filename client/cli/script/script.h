// Script parsed into statements, with matched blocks. For the runner. Plain data and a function without state.
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
  size_t line = 0;     // line number, from 1
  std::string text;    // text after the verb; for a command the whole line
  std::string reason;  // expect-error only: name of the expected failure of the command or commit
  size_t partner = 0;  // begin, commit, repeat and end only: index of the statement at the block's other end
};

struct Script {
  std::string name;  // name of the script in messages
  std::vector<Statement> statements;
};

// Parses a script. Returns a usage error for an unclosed or overlapping block, a command that is not allowed in a
// batch, an unknown failure after expect-error, a control character, or an exceeded limit of script_limits.h. The
// error's message begins with name:line, or with the name alone if the script as a whole exceeds a limit. Does not
// parse the text of the statements. Cost: linear in the text.
absl::StatusOr<Script> parse_script(const std::string& name, absl::string_view text);

// Returns the statement's place as "name:line".
std::string place_of(const Script& script, const Statement& statement);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_SCRIPT_H_
