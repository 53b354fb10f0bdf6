#include "client/cli/script/words.h"

#include <utility>

#include "client/cli/script/expression.h"
#include "client/cli/script/quoted_text.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

bool ends_word(const Cursor& cursor) { return cursor.ended() || cursor.peek() == ' ' || cursor.peek() == '\t'; }

// Reads the variable, the expression in braces or the quoted text at the cursor.
absl::StatusOr<Value> read_part(Cursor& cursor, const Variables& variables) {
  if (cursor.accept("$")) return read_variable(cursor, variables);
  if (cursor.peek() == '{') return read_braces(cursor, variables);
  return read_quoted_text(cursor, variables);
}

absl::StatusOr<Word> read_word(Cursor& cursor, const Variables& variables) {
  Word word;
  while (!ends_word(cursor)) {
    if (absl::StrContains("$'\"{", cursor.peek())) {
      ASSIGN_OR_RETURN(const Value value, read_part(cursor, variables));
      RETURN_IF_ERROR(append_value(word.text, value));
      word.bare = false;
      continue;
    }
    if (cursor.accept("\\")) {
      if (cursor.ended())
        return absl::InvalidArgumentError("nothing follows the last backslash: a line cannot be continued");
      word.bare = false;
    }
    word.text += cursor.next();
  }
  return word;
}

}  // namespace

absl::StatusOr<std::vector<Word>> read_words(absl::string_view line, const Variables& variables) {
  std::vector<Word> words;
  Cursor cursor(line);
  for (cursor.skip_blanks(); !cursor.ended(); cursor.skip_blanks()) {
    ASSIGN_OR_RETURN(Word word, read_word(cursor, variables));
    words.push_back(std::move(word));
  }
  return words;
}

}  // namespace locus::cli
