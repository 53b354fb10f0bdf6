#include "client/cli/script/words.h"

#include "absl/strings/ascii.h"
#include "client/cli/failure.h"

namespace locus::cli {

absl::StatusOr<std::vector<std::string>> split_words(absl::string_view line) {
  std::vector<std::string> words;
  bool in_word = false;
  char quote = 0;
  for (size_t i = 0; i < line.size(); ++i) {
    char c = line[i];
    if (quote == 0 && absl::ascii_isspace(static_cast<unsigned char>(c))) {
      in_word = false;
      continue;
    }
    if (quote == 0 && !in_word && c == '#') break;
    if (!in_word) words.emplace_back();
    in_word = true;
    if (c == quote) {
      quote = 0;
    } else if (quote == 0 && (c == '\'' || c == '"')) {
      quote = c;
    } else {
      if (c == '\\' && quote != '\'') {
        if (++i == line.size()) return usage_error("a backslash ends the line: it must precede a character");
        c = line[i];
      }
      words.back() += c;
    }
  }
  if (quote != 0) return usage_error(absl::string_view(quote == '"' ? "a \" is not closed" : "a ' is not closed"));
  return words;
}

}  // namespace locus::cli
