// Runs a whole script: checks every line, then runs line after line, with loops, counts and a verdict. For the run
// command. Functions without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_RUNNER_H_
#define LOCUS_CLIENT_CLI_SCRIPT_RUNNER_H_

#include <cstdint>

#include "absl/status/status.h"
#include "client/cli/context.h"
#include "client/cli/script/script.h"
#include "client/cli/script/variables.h"

namespace locus::cli {

enum class AfterFailure { kStop, kGoOn };

struct ScriptCounts {
  uint64_t lines = 0;   // that ran, those in loops each time
  uint64_t passed = 0;  // lines with expect or expect-error
  uint64_t failed = 0;
  uint64_t broken = 0;  // other lines that failed
};

// Reads every line as running it would, its command by the parser of commands, with results unknown and each loop gone
// through once; sends nothing and needs no server. A usage error beginning with name:line for the first mistake.
absl::Status check_script(const Script& script, const Variables& variables, Context& context, ScriptCounts& counts);

// Runs a script that was checked. A line that fails is written to the context's error stream at once, as name:line and
// what was found. The first failure ends the run; with kGoOn the run ends only where no server answers, and
// FAILED_PRECONDITION tells of failures. A batch left open by a failure is dropped, nothing of it sent.
absl::Status run_script(const Script& script, const Variables& variables, AfterFailure after, Context& context,
                        ScriptCounts& counts);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_RUNNER_H_
