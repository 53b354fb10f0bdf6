// Parser of script expressions, which also evaluates them:
//
//   list    = sum {"," sum}                          only numbers, if there are several
//   sum     = product {("+" | "-") product}
//   product = unary {("*" | "/" | "%") unary}
//   unary   = {"-"} primary
//   primary = number | number,number,number | text | true | false | null | variable | function "(" [sum {"," sum}] ")"
//           | "(" list ")" | "{" list "}"
//
// Three numbers separated by commas without blanks are one vector, which is formed before any operator is applied. The
// result of an expression with an unknown value is unknown. Used by the parsers of statements and of words. Functions
// without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_EXPRESSION_H_
#define LOCUS_CLIENT_CLI_SCRIPT_EXPRESSION_H_

#include "absl/status/statusor.h"
#include "client/cli/script/cursor.h"
#include "client/cli/script/value.h"
#include "client/cli/script/variables.h"

namespace locus::cli {

// Reads and evaluates an expression; stops at the first text that cannot continue it. If an operand is missing, returns
// INVALID_ARGUMENT with the text found in its place. If an operation is not possible, returns the error of number.h or
// value.h. Cost: linear in the text.
absl::StatusOr<Value> read_expression(Cursor& cursor, const Variables& variables);

// Reads `{list}`. Precondition: the cursor is at the opening brace.
absl::StatusOr<Value> read_braces(Cursor& cursor, const Variables& variables);

// Reads `name.field[0]` or `{name.field:-default}`. The default is used if the variable does not exist, or its value is
// null or a column without rows. Precondition: the cursor is just after the "$".
absl::StatusOr<Value> read_variable(Cursor& cursor, const Variables& variables);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_EXPRESSION_H_
