// Explanations of lines that the parser (CLI11) refuses: they name the word that is wrong and what to write instead.
// The parser's own messages name neither for an unknown command, and list unexpected words in reverse order. Functions
// without state.
#ifndef LOCUS_CLIENT_CLI_MISTAKES_H_
#define LOCUS_CLIENT_CLI_MISTAKES_H_

#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// Mistake in a line, and the command to which it belongs.
struct Mistake {
  std::string message;  // such as "`locus scene` has no command `ls`; did you mean `list`?"
  std::string command;  // such as "locus scene"
};

// Returns the mistake in the line `arguments`, which `app` has refused with `error`. The message is the parser's own
// unless the line has an unknown command, option or word, or lacks a command.
Mistake mistake_in(const CLI::App& app, const std::vector<std::string>& arguments, const CLI::ParseError& error);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_MISTAKES_H_
