// Runner of scripts: Lua with the module `locus`, or plain lines of `locus`. For the commands `run` and `shell`.
// Functions without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_RUNNER_H_
#define LOCUS_CLIENT_CLI_SCRIPT_RUNNER_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/context.h"
#include "client/cli/script/module.h"
#include "client/cli/script/script_limits.h"

namespace locus::cli {

enum class ScriptLanguage { kLua, kLines };

struct Script {
  std::string name;  // path, or "stdin"
  std::string text;
  ScriptLanguage language = ScriptLanguage::kLua;
};

// Reads a script from `file`, or from standard input if `file` is "-". A file called *.lua is Lua and one called
// *.locus has plain lines. Another text is Lua if it compiles; otherwise it has plain lines if its first word is a
// command of `locus`. Returns NOT_FOUND for a missing file, and a usage error for a text that is larger than
// kMaxScriptBytes.
absl::StatusOr<Script> read_script(const std::string& file, Context& context);

// Returns whether `word` is a command or an option of the command line.
bool is_command(const std::string& word, Context& context);

struct LineCounts {
  uint64_t run = 0;
  uint64_t failed = 0;
};

// Runs the lines of `script`, one command each, after the options of every line were checked. Prints the error of a
// line that fails, with name:line. With kStop the first error ends the run. With kGoOn the run continues unless the
// server cannot be reached, and FAILED_PRECONDITION is returned at the end. If `check_only` is set, nothing is sent.
absl::Status run_lines(const Script& script, AfterFailure after, bool check_only, Context& context, LineCounts& counts);

// Runs a script in Lua. `settings` become fields of the global table `args`. Returns the script's error, with file and
// line, or FAILED_PRECONDITION if expectations failed. If `check_only` is set, the script is only compiled.
absl::Status run_lua(const Script& script, const std::vector<std::pair<std::string, std::string>>& settings,
                     const ScriptLimits& limits, AfterFailure after, bool check_only, Context& context,
                     ScriptCounts& counts);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_RUNNER_H_
