// Splitter of a line of `locus` into its arguments, with the quotes of a shell. Function without state; any thread.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_WORDS_H_
#define LOCUS_CLIENT_CLI_SCRIPT_WORDS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

// Splits a line at blanks. Text in single quotes is literal; in double quotes and outside of quotes a backslash makes
// the next character literal. `#` at the beginning of a word begins a comment. Returns a usage error for a quote that
// is not closed and for a backslash at the end of the line.
absl::StatusOr<std::vector<std::string>> split_words(absl::string_view line);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_WORDS_H_
