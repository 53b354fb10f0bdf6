// Parser that splits a line of a script into words as a shell does, and substitutes variables and expressions. For
// statements. Functions without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_WORDS_H_
#define LOCUS_CLIENT_CLI_SCRIPT_WORDS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/script/variables.h"

namespace locus::cli {

struct Word {
  std::string text;
  bool bare = true;  // literal: nothing was quoted or substituted
};

// Splits a line at blanks; quotes and a backslash preserve blanks, and `#` at the beginning of a word begins a comment.
// `$name.field`, `${name:-default}` and `{expression}` are substituted, and the result never splits a word. Returns
// INVALID_ARGUMENT for an unclosed quote or brace, the errors of expressions, and RESOURCE_EXHAUSTED for a word of more
// than kMaxTextBytes.
absl::StatusOr<std::vector<Word>> read_words(absl::string_view line, const Variables& variables);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_WORDS_H_
