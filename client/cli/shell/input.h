// Kinds of input of the shell. Functions without state.
#ifndef LOCUS_CLIENT_CLI_SHELL_INPUT_H_
#define LOCUS_CLIENT_CLI_SHELL_INPUT_H_

#include <string>
#include <vector>

#include "client/cli/extras/completion/table.h"

namespace locus::cli {

enum class InputKind { kNothing, kHelp, kUse, kEnd, kCommand, kLua };

// Returns what `line` is. A line is a command if its first word is a command of `table` and it is no assignment, call
// or index of Lua, such as `scene = 1` or `query(1)`. A line that begins with an option is a command, too.
InputKind kind_of_input(const std::string& line, const std::vector<TableEntry>& table);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SHELL_INPUT_H_
