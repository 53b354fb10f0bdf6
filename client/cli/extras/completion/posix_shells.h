// Completion scripts for bash and zsh, which share shell functions written in the language of sh. Internal to the
// completion scripts.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_POSIX_SHELLS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_POSIX_SHELLS_H_

#include <string>

#include "client/cli/command_words.h"

namespace locus::cli {

// Return the whole script that completes `program`.
std::string bash_script(const CommandWords& program);
std::string zsh_script(const CommandWords& program);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_POSIX_SHELLS_H_
