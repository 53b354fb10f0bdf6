// Functions to build the command-line parser and to run one line of arguments. For main(), scripts and tests.
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

// Parses `arguments` (without the program's name) and runs the command. Writes the answer or the error to the streams
// of `context`. Help and --version count as success.
ExitCode run_line(const std::vector<std::string>& arguments, Context& context);

// Runs a line of a script. Unlike run_line(), returns the error instead of writing it; a line that does not parse is a
// usage error. Global options apply to this line only. If lines are only checked (Lines::kScriptCheck), nothing is sent
// or written.
absl::Status run_script_line(const std::vector<std::string>& arguments, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_RUN_H_
