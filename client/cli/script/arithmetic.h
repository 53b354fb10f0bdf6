// Calculation of + - * / % on values. For expressions. A function without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_ARITHMETIC_H_
#define LOCUS_CLIENT_CLI_SCRIPT_ARITHMETIC_H_

#include "absl/status/statusor.h"
#include "client/cli/script/value.h"

namespace locus::cli {

// Applies the operator `sign`. Two numbers allow every operator, but % requires integers. Two vectors allow + and -
// only. A vector and a number allow * in either order; a vector can also be divided by a number. The result is unknown
// if an operand is unknown. Returns INVALID_ARGUMENT, with the values in the message, for any other combination.
// Returns OUT_OF_RANGE for division by zero, for % of numbers that are not integers, and for results that are not
// finite or do not fit 64 bits.
absl::StatusOr<Value> calculate(char sign, const Value& left, const Value& right);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_ARITHMETIC_H_
