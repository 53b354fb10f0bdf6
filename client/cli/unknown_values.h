// Placeholders of unknown values. All lines of a script are checked before the first one runs, when the values of
// variables are not known: a mark stands for such a value, and the parser accepts it for any option. For the reader of
// scripts and run_script_line().
#ifndef LOCUS_CLIENT_CLI_UNKNOWN_VALUES_H_
#define LOCUS_CLIENT_CLI_UNKNOWN_VALUES_H_

#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// Mark of an unknown value, a character that scripts cannot contain.
inline constexpr char kNotKnownYet = '\x1a';

bool has_unknown(const std::vector<std::string>& arguments);

// Makes every option of `app` accept a text with the mark, by replacing it with a valid value.
void accept_unknown_values(CLI::App& app);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_UNKNOWN_VALUES_H_
