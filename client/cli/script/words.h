// Divides a line of a script into words as a shell does, with variables and expressions filled in. For statements.
// Functions without state.
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
  bool bare = true;  // as it stands in the line: nothing quoted, nothing filled in
};

// Words end at blanks; quotes and a backslash keep blanks; `#` where a word would begin starts a comment.
// `$name.field`,
// `${name:-default}` and `{expression}` are filled in and never divide a word. INVALID_ARGUMENT for what is not closed,
// the errors of expressions, RESOURCE_EXHAUSTED for a word beyond kMaxTextBytes.
absl::StatusOr<std::vector<Word>> read_words(absl::string_view line, const Variables& variables);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_WORDS_H_
