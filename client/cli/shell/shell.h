// Loop of `locus shell`. Function without state.
#ifndef LOCUS_CLIENT_CLI_SHELL_SHELL_H_
#define LOCUS_CLIENT_CLI_SHELL_SHELL_H_

#include "absl/status/status.h"
#include "client/cli/context.h"
#include "client/cli/script/script_limits.h"

namespace locus::cli {

// Reads inputs from standard input, runs them and writes their errors, until the input or the user ends the shell.
// Returns an error only if the shell could not begin.
absl::Status run_shell(const ScriptLimits& limits, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SHELL_SHELL_H_
