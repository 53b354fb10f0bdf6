// The command line as functions: build the parser, run one line of arguments. For main(), scripts and tests.
#ifndef LOCUS_CLIENT_CLI_RUN_H_
#define LOCUS_CLIENT_CLI_RUN_H_

#include <string>
#include <vector>

#include "CLI/CLI.hpp"
#include "client/cli/context.h"
#include "client/cli/failure.h"

namespace locus::cli {

// Adds every command and global option to `app`. The commands run through `context`, which must outlive `app`.
void build_cli(CLI::App& app, Context& context);

// Parses `arguments` (without the program's name), runs the command and writes its answer or its error to the context's
// streams. Help and --version count as success.
ExitCode run_line(const std::vector<std::string>& arguments, Context& context);

// Runs a line of a script: writes the answer and returns the error instead of writing it; a line that does not parse is
// a usage error. Global options apply to this line only. If lines are only checked, nothing is run or written.
absl::Status run_script_line(const std::vector<std::string>& arguments, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_RUN_H_
