// Completion scripts for shells, generated from the command-line parser. A script consists of a table, with a line for
// each command, option and positional argument, and shell functions that read the table. The shell computes the
// candidates without running the program, except for scene names. To complete a scene name, the script runs the
// program. The program requests the scene names from the server that the command line selects, with a timeout of one
// second. Functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_COMPLETION_H_
#define LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_COMPLETION_H_

#include <string>

#include "client/cli/command_words.h"

namespace locus::cli {

enum class Shell { kBash, kZsh, kFish };

// Returns the script that completes command lines of `program`. Subcommands may be nested to any depth. A subcommand
// also accepts the options of all commands above it.
std::string completion_script(const CommandWords& program, Shell shell);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_COMPLETION_H_
