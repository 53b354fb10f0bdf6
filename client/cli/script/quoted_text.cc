#include "client/cli/script/quoted_text.h"

#include <utility>

#include "client/cli/script/expression.h"
#include "client/cli/script/script_limits.h"
#include "client/cli/unknown_values.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

absl::Status not_closed(char quote) {
  return absl::InvalidArgumentError(absl::StrCat("a text is not closed: ", std::string(1, quote), " is missing"));
}

absl::StatusOr<Value> read_single_quoted(Cursor& cursor) {
  const size_t end = cursor.rest().find('\'');
  if (end == absl::string_view::npos) return not_closed('\'');
  std::string text(cursor.rest().substr(0, end));
  cursor.move_to(cursor.at() + end + 1);
  return Value::of(Json(std::move(text)));
}

// Reads the rest of an escape sequence. Precondition: the cursor is just after the backslash.
absl::Status read_escape(Cursor& cursor, std::string& text) {
  if (cursor.ended()) return not_closed('"');
  const char c = cursor.next();
  if (c == 'n' || c == 't') {
    text += c == 'n' ? '\n' : '\t';
    return absl::OkStatus();
  }
  if (!absl::StrContains("\"\\${}", c)) {
    return absl::InvalidArgumentError(
        absl::StrCat("\\", std::string(1, c), " is not an escape sequence: write \\\\ for a backslash"));
  }
  text += c;
  return absl::OkStatus();
}

absl::StatusOr<Value> read_double_quoted(Cursor& cursor, const Variables& variables) {
  std::string text;
  bool known = true;
  while (!cursor.accept("\"")) {
    if (cursor.ended()) return not_closed('"');
    if (cursor.peek() == '$' || cursor.peek() == '{') {
      ASSIGN_OR_RETURN(const Value value,
                       cursor.accept("$") ? read_variable(cursor, variables) : read_braces(cursor, variables));
      known &= value.known();
      RETURN_IF_ERROR(append_value(text, value));
    } else if (cursor.accept("\\")) {
      RETURN_IF_ERROR(read_escape(cursor, text));
    } else {
      text += cursor.next();
    }
  }
  return known ? Value::of(Json(std::move(text))) : Value::unknown();
}

}  // namespace

absl::Status append_value(std::string& text, const Value& value) {
  if (!value.known()) {
    text += kNotKnownYet;
    return absl::OkStatus();
  }
  ASSIGN_OR_RETURN(const std::string more, text_of(value));
  if (text.size() + more.size() > kMaxTextBytes) {
    return absl::ResourceExhaustedError(absl::StrCat("a text is longer than ", kMaxTextBytes, " bytes"));
  }
  text += more;
  return absl::OkStatus();
}

absl::StatusOr<Value> read_quoted_text(Cursor& cursor, const Variables& variables) {
  LOCUS_DCHECK(cursor.peek() == '"' || cursor.peek() == '\'');
  if (cursor.next() == '\'') return read_single_quoted(cursor);
  RETURN_IF_ERROR(cursor.open());
  absl::StatusOr<Value> text = read_double_quoted(cursor, variables);
  cursor.close();
  return text;
}

}  // namespace locus::cli
