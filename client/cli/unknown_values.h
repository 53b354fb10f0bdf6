// Lines of a script are checked before any of them runs, when results are not known yet. A mark stands for such a
// value, and the parser of a line takes it for any option. For the reader of scripts and run_script_line.
#ifndef LOCUS_CLIENT_CLI_UNKNOWN_VALUES_H_
#define LOCUS_CLIENT_CLI_UNKNOWN_VALUES_H_

#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// No text of a script holds the character.
inline constexpr char kNotKnownYet = '\x1a';

bool has_unknown(const std::vector<std::string>& arguments);

// Makes every option take a text with the mark, as if it were a value that suits it.
void accept_unknown_values(CLI::App& app);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_UNKNOWN_VALUES_H_
