// Completion scripts for shells, written from the parser. A script holds one table, a line for each command, option and
// positional, and a few functions that read it: what is between them and the cursor is decided in the shell, without a
// call of the program. Only the names of scenes are asked for, from the server that the line names, for a second at
// most.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_COMPLETION_H_
#define LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_COMPLETION_H_

#include <string>

#include "client/cli/command_words.h"

namespace locus::cli {

enum class Shell { kBash, kZsh, kFish };

// The script that completes lines of `program`. Its commands may stand on any number of levels; the options of a
// command are also those of all commands below it.
std::string completion_script(const CommandWords& program, Shell shell);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_COMPLETION_H_
