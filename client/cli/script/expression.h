// Reads an expression of a script and gives its value at once:
//
//   list    = sum {"," sum}                          numbers only where there are several
//   sum     = product {("+" | "-") product}
//   product = unary {("*" | "/" | "%") unary}
//   unary   = {"-"} primary
//   primary = number | number,number,number | text | true | false | null | variable | function "(" [sum {"," sum}] ")"
//           | "(" list ")" | "{" list "}"
//
// Three numbers with commas and without blanks are one vector, before anything is done with them. For statements and
// words. Functions without state. Values not known yet make whatever they enter unknown.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_EXPRESSION_H_
#define LOCUS_CLIENT_CLI_SCRIPT_EXPRESSION_H_

#include "absl/status/statusor.h"
#include "client/cli/script/cursor.h"
#include "client/cli/script/value.h"
#include "client/cli/script/variables.h"

namespace locus::cli {

// Stops at the first thing that does not go on the expression. INVALID_ARGUMENT naming what was found where an operand
// should be; the errors of number.h and value.h for what cannot be calculated. Time linear in the text.
absl::StatusOr<Value> read_expression(Cursor& cursor, const Variables& variables);

// The cursor stands on "{": the list between braces.
absl::StatusOr<Value> read_braces(Cursor& cursor, const Variables& variables);

// The cursor stands behind the "$": `name.field[0]`, or `{name.field:-default}`, which is the default where the
// variable, or the value, is not there.
absl::StatusOr<Value> read_variable(Cursor& cursor, const Variables& variables);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_EXPRESSION_H_
