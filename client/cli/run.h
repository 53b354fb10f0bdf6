// The command line as a function: builds the parser and runs one line of arguments. For main and for tests.
#ifndef LOCUS_CLIENT_CLI_RUN_H_
#define LOCUS_CLIENT_CLI_RUN_H_

#include <string>
#include <vector>

#include "CLI/CLI.hpp"
#include "client/cli/context.h"
#include "client/cli/failure.h"

namespace locus::cli {

// Adds every command and global option to `app`, to run through `context`, which outlives it.
void build_cli(CLI::App& app, Context& context);

// Parses `arguments` (without the program's name), runs the command and writes its answer, or what went wrong, to the
// context's streams. Help and --version count as success.
ExitCode run_line(const std::vector<std::string>& arguments, Context& context);

// The same for a line of a script: answers are written, what went wrong is returned, a wrong line as a usage error. Its
// global options hold for that line alone. Where lines are only checked, nothing is run or written.
absl::Status run_script_line(const std::vector<std::string>& arguments, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_RUN_H_
