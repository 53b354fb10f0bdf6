// Runner of a whole script: checks every line, then runs the lines with loops, and counts results. For the run command.
// Functions without state.
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
  uint64_t lines = 0;   // lines that ran; a line in a loop counts each time
  uint64_t passed = 0;  // passed lines with expect or expect-error
  uint64_t failed = 0;
  uint64_t broken = 0;  // failed lines without expect and expect-error
};

// Checks every line as if it ran, including the options of its command. The results of commands are unknown, and each
// loop has one round. Sends nothing and needs no server. If lines have mistakes, returns a usage error for the first
// such line; the error's message begins with name:line.
absl::Status check_script(const Script& script, const Variables& variables, Context& context, ScriptCounts& counts);

// Runs a checked script. As soon as a line fails, writes its error, with name:line, to the context's error stream. With
// kStop, the first failure ends the run. With kGoOn the run continues after a failure, and the function returns
// FAILED_PRECONDITION at the end if lines have failed. If the server cannot be reached, the run ends even with kGoOn.
// If a batch is still open when the run ends, the batch is dropped and none of its changes are sent.
absl::Status run_script(const Script& script, const Variables& variables, AfterFailure after, Context& context,
                        ScriptCounts& counts);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_RUNNER_H_
