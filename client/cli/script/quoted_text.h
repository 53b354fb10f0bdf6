// Reads a quoted text of a script, and fills values into texts. For expressions and words. Functions without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_QUOTED_TEXT_H_
#define LOCUS_CLIENT_CLI_SCRIPT_QUOTED_TEXT_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/script/cursor.h"
#include "client/cli/script/value.h"
#include "client/cli/script/variables.h"

namespace locus::cli {

// Appends the value's text, or the mark of one that is not known yet. RESOURCE_EXHAUSTED where that gets longer than
// kMaxTextBytes.
absl::Status append_value(std::string& text, const Value& value);

// The cursor stands on a quote. Between single quotes everything is as it stands. Between double quotes `$name` and
// `{expression}` are filled in, and \" \\ \$ \{ \n \t are what they say. INVALID_ARGUMENT where the quote is not
// closed.
absl::StatusOr<Value> read_quoted_text(Cursor& cursor, const Variables& variables);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_QUOTED_TEXT_H_
