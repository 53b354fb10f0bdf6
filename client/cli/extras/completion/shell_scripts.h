// Completion script of each shell. The scripts for bash and zsh share the functions that read the table, which use only
// syntax that both shells accept. The functions for fish are written separately, because the language of fish differs.
// Internal to extras/completion/.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_SHELL_SCRIPTS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_SHELL_SCRIPTS_H_

#include <string>

#include "client/cli/command_words.h"

namespace locus::cli {

// Return the whole script that completes `program`.
std::string bash_script(const CommandWords& program);  // in posix_shells.cc, like zsh_script()
std::string zsh_script(const CommandWords& program);
std::string fish_script(const CommandWords& program);  // in fish.cc

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_SHELL_SCRIPTS_H_
