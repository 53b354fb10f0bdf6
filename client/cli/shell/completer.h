// Completion of lines of the shell, from the same table as the completions of bash, zsh and fish. Function without
// state.
#ifndef LOCUS_CLIENT_CLI_SHELL_COMPLETER_H_
#define LOCUS_CLIENT_CLI_SHELL_COMPLETER_H_

#include <functional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "client/cli/extras/completion/table.h"

namespace locus::cli {

// Returns the names of the scenes of the server; empty if they are not known.
using SceneNames = std::function<std::vector<std::string>()>;

// Returns the words that could stand for the last word of `line`, which may be empty, in alphabetical order: commands,
// options, words of an option, scenes. `scenes` is called only where a scene may stand.
std::vector<std::string> complete(const std::vector<TableEntry>& table, absl::string_view line,
                                  const SceneNames& scenes);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SHELL_COMPLETER_H_
