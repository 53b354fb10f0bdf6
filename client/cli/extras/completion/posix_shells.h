// What bash and zsh share: both read functions in the language of sh. Internal to the completion scripts.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_POSIX_SHELLS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_POSIX_SHELLS_H_

#include <string>

#include "client/cli/command_words.h"

namespace locus::cli {

// The scripts of each shell, complete.
std::string bash_script(const CommandWords& program);
std::string zsh_script(const CommandWords& program);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_POSIX_SHELLS_H_
