// Placeholders for unknown values. All lines of a script are checked before the first line runs. At that time the
// results of commands are not known, so each unknown value is replaced by a placeholder character, which the parser
// accepts as a value of any option. For the reader of scripts and run_script_line().
#ifndef LOCUS_CLIENT_CLI_UNKNOWN_VALUES_H_
#define LOCUS_CLIENT_CLI_UNKNOWN_VALUES_H_

#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// Placeholder of an unknown value; a character that scripts cannot contain.
inline constexpr char kNotKnownYet = '\x1a';

bool has_unknown(const std::vector<std::string>& arguments);

// Makes every option of `app` accept an argument that contains kNotKnownYet: before the option checks the argument, the
// argument is replaced by some value that the option accepts.
void accept_unknown_values(CLI::App& app);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_UNKNOWN_VALUES_H_
