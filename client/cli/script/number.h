// Numbers of scripts: exact integers, which cover all 64-bit ids, or doubles. For values and expressions. Plain values
// and functions without state. Invariant: a Number is finite, and an integer is within -2^63 .. 2^64 - 1. Results
// outside this range are refused with OUT_OF_RANGE, never rounded.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_NUMBER_H_
#define LOCUS_CLIENT_CLI_SCRIPT_NUMBER_H_

#include <optional>
#include <string>
#include <variant>

#include "absl/numeric/int128.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/output.h"

namespace locus::cli {

using Number = std::variant<absl::int128, double>;

// Parses the whole text as a decimal or hexadecimal (0x) integer, or as a double with a point or an exponent. Returns
// nullopt for any other text, including "inf" and integers that do not fit 64 bits.
std::optional<Number> parse_number(absl::string_view text);
// Returns the number, or nullopt if the JSON value is not a number.
std::optional<Number> number_from(const Json& json);
Json json_of(const Number& number);
// Returns a text that parses to the same number; a double has as few digits as possible.
std::string text_of(const Number& number);
// Returns the number as the nearest double.
double real(const Number& number);
// Returns `value`, or OUT_OF_RANGE if it is not finite.
absl::StatusOr<Number> finite(double value);

// Calculate a result. If both operands are integers and the exact result is integral, the result is an integer; for
// example, divide() of 6 and 3 returns the integer 2.
absl::StatusOr<Number> add(const Number& a, const Number& b);
absl::StatusOr<Number> subtract(const Number& a, const Number& b);
absl::StatusOr<Number> multiply(const Number& a, const Number& b);
absl::StatusOr<Number> divide(const Number& a, const Number& b);
// Returns the remainder of two integers, with the sign of `b`.
absl::StatusOr<Number> modulo(const Number& a, const Number& b);

// Returns a value below, equal to or above 0 for a < b, a == b or a > b. The comparison is exact, even between an
// integer and a double.
int compare(const Number& a, const Number& b);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_NUMBER_H_
