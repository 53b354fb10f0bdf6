// Numbers of scripts: integers exact over all 64-bit ids, or doubles. For values and expressions. Plain values and
// functions without state. A Number is always finite, an integer from -2^63 to 2^64 - 1: what would leave that range is
// refused with OUT_OF_RANGE, never rounded.
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

// The whole text as a number: decimal, 0x hexadecimal, or with point or exponent. Nothing for anything else, "inf" and
// integers beyond 64 bits included.
std::optional<Number> parse_number(absl::string_view text);
// Returns the number, or nullopt if the JSON value is not a number.
std::optional<Number> number_from(const Json& json);
Json json_of(const Number& number);
// Reads back as the same number; doubles in the fewest digits.
std::string text_of(const Number& number);
// The nearest double.
double real(const Number& number);
// Refuses what is not finite.
absl::StatusOr<Number> finite(double value);

// Two integers stay integers wherever the result is one, division included.
absl::StatusOr<Number> add(const Number& a, const Number& b);
absl::StatusOr<Number> subtract(const Number& a, const Number& b);
absl::StatusOr<Number> multiply(const Number& a, const Number& b);
absl::StatusOr<Number> divide(const Number& a, const Number& b);
// Returns the remainder of two integers, with the sign of `b`.
absl::StatusOr<Number> modulo(const Number& a, const Number& b);

// Below 0, 0 or above 0 as a < b, a == b, a > b; exact also between an integer and a double.
int compare(const Number& a, const Number& b);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_NUMBER_H_
