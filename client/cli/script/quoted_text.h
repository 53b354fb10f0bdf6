// Parser of quoted texts in scripts, which substitutes values in them. For expressions and words. Functions without
// state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_QUOTED_TEXT_H_
#define LOCUS_CLIENT_CLI_SCRIPT_QUOTED_TEXT_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/script/cursor.h"
#include "client/cli/script/value.h"
#include "client/cli/script/variables.h"

namespace locus::cli {

// Appends the value as text, or kNotKnownYet for an unknown value. Returns RESOURCE_EXHAUSTED if `text` would exceed
// kMaxTextBytes.
absl::Status append_value(std::string& text, const Value& value);

// Reads a quoted text. Precondition: the cursor is at the opening quote. Text in single quotes is taken literally. In
// double quotes `$name` and `{expression}` are substituted, and \" \\ \$ \{ \} \n \t are escape sequences. Returns
// INVALID_ARGUMENT if the closing quote is missing or a backslash begins no escape sequence.
absl::StatusOr<Value> read_quoted_text(Cursor& cursor, const Variables& variables);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_QUOTED_TEXT_H_
