#include "client/cli/script/expectation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/script/cursor.h"
#include "client/cli/script/expression.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr const char* kComparisons[] = {"==", "!=", "<=", ">=", "<", ">", "contains"};

absl::StatusOr<std::string> read_comparison(Cursor& cursor) {
  cursor.skip_blanks();
  for (const char* comparison : kComparisons) {
    if (cursor.accept(comparison)) return std::string(comparison);
  }
  return absl::InvalidArgumentError(absl::StrCat("expected one of == != < <= > >= contains, found ", cursor.found()));
}

// Returns the tolerance after `within`, or nullopt if no `within` follows.
absl::StatusOr<std::optional<Value>> read_tolerance(Cursor& cursor, const Variables& variables) {
  cursor.skip_blanks();
  if (!cursor.accept("within")) return std::nullopt;
  ASSIGN_OR_RETURN(Value tolerance, read_expression(cursor, variables));
  return std::optional<Value>(std::move(tolerance));
}

bool entries_equal(const Json& a, const Json& b) {
  const absl::StatusOr<Number> x = number_of(Value::of(a));
  const absl::StatusOr<Number> y = number_of(Value::of(b));
  if (x.ok() && y.ok()) return compare(*x, *y) == 0;
  if (!a.is_string() && !b.is_string()) return a == b;
  const absl::StatusOr<std::string> left = text_of(Value::of(a));
  const absl::StatusOr<std::string> right = text_of(Value::of(b));
  return left.ok() && right.ok() && *left == *right;
}

bool equal(const Json& a, const Json& b) {
  if (a.is_array() && b.is_array()) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), entries_equal);
  }
  const absl::StatusOr<Vector> left = vector_of(Value::of(a));
  const absl::StatusOr<Vector> right = vector_of(Value::of(b));
  return left.ok() && right.ok() ? *left == *right : entries_equal(a, b);
}

absl::StatusOr<bool> contains(const Json& whole, const Json& part) {
  if (whole.is_array()) {
    return std::any_of(whole.begin(), whole.end(), [&](const Json& entry) { return equal(entry, part); });
  }
  ASSIGN_OR_RETURN(const std::string text, text_of(Value::of(part)));
  if (whole.is_string()) return absl::StrContains(whole.get_ref<const std::string&>(), text);
  return equal(whole, part);  // `whole` is a column with one row
}

// Compares two numbers, or two vectors part by part.
absl::StatusOr<bool> near(const Value& left, const Value& right, const Value& tolerance) {
  ASSIGN_OR_RETURN(const Number bound, number_of(tolerance));
  if (real(bound) < 0) return absl::InvalidArgumentError("a tolerance must not be negative");
  if (const absl::StatusOr<Number> x = number_of(left), y = number_of(right); x.ok() && y.ok()) {
    const absl::StatusOr<Number> difference = subtract(*x, *y);
    return difference.ok() ? std::abs(real(*difference)) <= real(bound) : absl::StatusOr<bool>(false);
  }
  ASSIGN_OR_RETURN(const Vector a, vector_of(left));
  ASSIGN_OR_RETURN(const Vector b, vector_of(right));
  return std::equal(a.begin(), a.end(), b.begin(), [&](double x, double y) { return std::abs(x - y) <= real(bound); });
}

absl::StatusOr<bool> ordered(const std::string& comparison, const Value& left, const Value& right) {
  ASSIGN_OR_RETURN(const Number a, number_of(left));
  ASSIGN_OR_RETURN(const Number b, number_of(right));
  const int order = compare(a, b);
  if (comparison == "<") return order < 0;
  if (comparison == "<=") return order <= 0;
  return comparison == ">" ? order > 0 : order >= 0;
}

absl::StatusOr<bool> holds(const Expectation& expectation) {
  if (expectation.tolerance) return near(expectation.left, expectation.right, *expectation.tolerance);
  const std::string& comparison = expectation.comparison;
  if (comparison.front() == '<' || comparison.front() == '>') {
    return ordered(comparison, expectation.left, expectation.right);
  }
  ASSIGN_OR_RETURN(const Json left, plain(expectation.left));
  ASSIGN_OR_RETURN(const Json right, plain(expectation.right));
  if (comparison == "contains") return contains(left, right);
  return equal(left, right) == (comparison == "==");
}

}  // namespace

absl::StatusOr<Expectation> read_expectation(absl::string_view text, const Variables& variables) {
  Expectation expectation;
  Cursor cursor(text);
  ASSIGN_OR_RETURN(Value left, read_expression(cursor, variables));
  ASSIGN_OR_RETURN(std::string comparison, read_comparison(cursor));
  const size_t right_begin = cursor.at();
  ASSIGN_OR_RETURN(Value right, read_expression(cursor, variables));
  expectation.right_text = std::string(absl::StripAsciiWhitespace(cursor.since(right_begin)));
  ASSIGN_OR_RETURN(std::optional<Value> tolerance, read_tolerance(cursor, variables));
  expectation.text = std::string(absl::StripAsciiWhitespace(cursor.since(0)));
  cursor.skip_blanks();
  if (!cursor.ended()) {
    return absl::InvalidArgumentError(absl::StrCat("expected the end of the line, found ", cursor.found()));
  }
  if (tolerance && comparison != "==") return absl::InvalidArgumentError("`within` is allowed only with ==");
  expectation.left = std::move(left);
  expectation.comparison = std::move(comparison);
  expectation.right = std::move(right);
  expectation.tolerance = std::move(tolerance);
  return expectation;
}

absl::Status verify(const Expectation& expectation) {
  const absl::StatusOr<bool> held = holds(expectation);
  if (held.ok() && *held) return absl::OkStatus();
  std::string message = absl::StrCat("expected ", expectation.text);
  // If the right side is an expression with variables, show its value too.
  if (absl::StrContains(expectation.right_text, "$")) {
    absl::StrAppend(&message, ", which is ", shown(expectation.right));
  }
  absl::StrAppend(&message, ", but it is ", shown(expectation.left));
  if (!held.ok()) absl::StrAppend(&message, ": ", held.status().message());
  return absl::FailedPreconditionError(message);
}

}  // namespace locus::cli
