// Completion script for fish, which needs its own functions because its language differs from that of sh. Internal to
// the completion scripts.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_FISH_H_
#define LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_FISH_H_

#include <string>

#include "client/cli/command_words.h"

namespace locus::cli {

// Returns the whole script that completes `program`.
std::string fish_script(const CommandWords& program);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_FISH_H_
