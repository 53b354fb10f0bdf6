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

// Returns `line` without the word `locus` before a command of `table`, as lines of a system shell have it.
std::string without_program(const std::string& line, const std::vector<TableEntry>& table);

// Returns "`WORD` is no command; did you mean `OTHER`?" for the first word of a line that is neither a command nor Lua;
// empty if no command of `table` is similar to the word.
std::string unknown_command(const std::string& line, const std::vector<TableEntry>& table);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SHELL_INPUT_H_
