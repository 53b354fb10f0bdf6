#include "client/cli/script/number.h"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace locus::cli {
namespace {

const absl::int128 kLowest = std::numeric_limits<int64_t>::min();
const absl::int128 kHighest = std::numeric_limits<uint64_t>::max();

bool is_integer(const Number& number) { return std::holds_alternative<absl::int128>(number); }
bool are_integers(const Number& a, const Number& b) { return is_integer(a) && is_integer(b); }
absl::int128 integer(const Number& number) { return std::get<absl::int128>(number); }

absl::StatusOr<Number> in_range(absl::int128 value) {
  if (value < kLowest || value > kHighest) return absl::OutOfRangeError("the result needs more than 64 bits");
  return Number(value);
}

template <class T>
int order(T a, T b) {
  return a < b ? -1 : (a > b ? 1 : 0);
}

// Compares an integer and a double without rounding. Method: `b` is split into its integer part and its fraction. The
// integer part fits 128 bits, because the range of `b` is checked first.
int compare_exactly(absl::int128 a, double b) {
  if (std::abs(b) >= 0x1p65) return b > 0 ? -1 : 1;
  const double whole = std::trunc(b);
  const int by_whole = order(a, absl::int128(whole));
  return by_whole != 0 ? by_whole : order(0.0, b - whole);
}

}  // namespace

std::optional<Number> parse_number(absl::string_view text) {
  absl::string_view digits = text;
  const bool negative = absl::ConsumePrefix(&digits, "-");
  if (digits.empty() || !(absl::ascii_isdigit(static_cast<unsigned char>(digits[0])) || digits[0] == '.')) return {};
  uint64_t magnitude = 0;
  absl::string_view hexadecimal = digits;
  const bool whole = absl::ConsumePrefix(&hexadecimal, "0x") ? absl::SimpleHexAtoi(hexadecimal, &magnitude)
                                                             : absl::SimpleAtoi(digits, &magnitude);
  if (whole) {
    const absl::int128 value = negative ? -absl::int128(magnitude) : absl::int128(magnitude);
    return value < kLowest ? std::nullopt : std::optional<Number>(value);
  }
  double value = 0;
  const bool fraction = digits.find_first_of(".eE") != absl::string_view::npos;
  if (!fraction || !absl::SimpleAtod(text, &value) || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<Number> number_from(const Json& json) {
  if (json.is_number_unsigned()) return absl::int128(json.get<uint64_t>());
  if (json.is_number_integer()) return absl::int128(json.get<int64_t>());
  if (json.is_number_float() && std::isfinite(json.get<double>())) return json.get<double>();
  return std::nullopt;
}

Json json_of(const Number& number) {
  if (!is_integer(number)) return std::get<double>(number);
  if (integer(number) < 0) return static_cast<int64_t>(integer(number));
  return static_cast<uint64_t>(integer(number));
}

std::string text_of(const Number& number) {
  if (is_integer(number)) {
    if (integer(number) < 0) return absl::StrCat(static_cast<int64_t>(integer(number)));
    return absl::StrCat(static_cast<uint64_t>(integer(number)));
  }
  std::array<char, 32> text{};
  const std::to_chars_result end = std::to_chars(text.data(), text.data() + text.size(), std::get<double>(number));
  return std::string(text.data(), end.ptr);
}

double real(const Number& number) {
  return is_integer(number) ? static_cast<double>(integer(number)) : std::get<double>(number);
}

absl::StatusOr<Number> finite(double value) {
  if (!std::isfinite(value)) return absl::OutOfRangeError("the result is not a finite number");
  return Number(value);
}

absl::StatusOr<Number> add(const Number& a, const Number& b) {
  return are_integers(a, b) ? in_range(integer(a) + integer(b)) : finite(real(a) + real(b));
}

absl::StatusOr<Number> subtract(const Number& a, const Number& b) {
  return are_integers(a, b) ? in_range(integer(a) - integer(b)) : finite(real(a) - real(b));
}

absl::StatusOr<Number> multiply(const Number& a, const Number& b) {
  if (!are_integers(a, b)) return finite(real(a) * real(b));
  // Check the product as a double first: beyond this limit the exact product may not even fit 128 bits.
  if (std::abs(real(a) * real(b)) > 0x1p65) return absl::OutOfRangeError("the result needs more than 64 bits");
  return in_range(integer(a) * integer(b));
}

absl::StatusOr<Number> divide(const Number& a, const Number& b) {
  if (compare(b, absl::int128(0)) == 0) return absl::OutOfRangeError("division by zero");
  if (are_integers(a, b) && integer(a) % integer(b) == 0) return in_range(integer(a) / integer(b));
  return finite(real(a) / real(b));
}

absl::StatusOr<Number> modulo(const Number& a, const Number& b) {
  if (!are_integers(a, b)) return absl::OutOfRangeError("% requires integers");
  if (integer(b) == 0) return absl::OutOfRangeError("division by zero");
  const absl::int128 rest = integer(a) % integer(b);
  return Number(rest != 0 && (rest < 0) != (integer(b) < 0) ? rest + integer(b) : rest);
}

int compare(const Number& a, const Number& b) {
  if (are_integers(a, b)) return order(integer(a), integer(b));
  if (is_integer(a)) return compare_exactly(integer(a), std::get<double>(b));
  if (is_integer(b)) return -compare_exactly(integer(b), std::get<double>(a));
  return order(std::get<double>(a), std::get<double>(b));
}

}  // namespace locus::cli
