#include "client/cli/script/expression.h"

#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/cli/script/arithmetic.h"
#include "client/cli/script/functions.h"
#include "client/cli/script/quoted_text.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using Answer = absl::StatusOr<Value>;

Answer read_sum(Cursor& cursor, const Variables& variables);

absl::Status expected(absl::string_view wanted, const Cursor& cursor) {
  return absl::InvalidArgumentError(absl::StrCat("expected ", wanted, ", found ", cursor.found()));
}

bool begins_number(const Cursor& cursor, size_t ahead = 0) {
  if (cursor.peek(ahead) == '-') ++ahead;
  if (cursor.peek(ahead) == '.') ++ahead;
  return absl::ascii_isdigit(static_cast<unsigned char>(cursor.peek(ahead)));
}

absl::StatusOr<Number> read_number(Cursor& cursor) {
  const size_t begin = cursor.at();
  cursor.accept("-");
  while (absl::ascii_isalnum(static_cast<unsigned char>(cursor.peek())) || cursor.peek() == '.') {
    const char c = cursor.next();
    const bool hexadecimal = absl::StartsWith(cursor.since(begin), "0x");
    if ((c == 'e' || c == 'E') && !hexadecimal && (cursor.peek() == '-' || cursor.peek() == '+')) cursor.next();
  }
  const std::optional<Number> number = parse_number(cursor.since(begin));
  if (number) return *number;
  return absl::InvalidArgumentError(absl::StrCat("`", cursor.since(begin), "` is not a number of at most 64 bits"));
}

// Reads a number, or a list of three or more numbers separated by commas without blanks; integers stay exact. If only
// two numbers follow each other, only the first is read, because the comma may separate the arguments of a function, as
// in min(1,2).
Answer read_numbers(Cursor& cursor) {
  Json numbers = Json::array();
  size_t behind_first = 0;
  while (true) {
    ASSIGN_OR_RETURN(const Number number, read_number(cursor));
    numbers.push_back(json_of(number));
    if (numbers.size() == 1) behind_first = cursor.at();
    if (cursor.peek() != ',' || !begins_number(cursor, 1)) break;
    cursor.next();
  }
  if (numbers.size() >= 3) return Value::of(std::move(numbers));
  cursor.move_to(behind_first);
  return Value::of(std::move(numbers[0]));
}

// Reads values separated by commas up to the character `end`, and reads `end` too.
absl::StatusOr<std::vector<Value>> read_arguments(Cursor& cursor, const Variables& variables, char end) {
  std::vector<Value> values;
  cursor.skip_blanks();
  while (cursor.peek() != end) {
    ASSIGN_OR_RETURN(Value value, read_sum(cursor, variables));
    values.push_back(std::move(value));
    cursor.skip_blanks();
    if (cursor.peek() != end && !cursor.accept(","))
      return expected(absl::StrCat("`", std::string(1, end), "`"), cursor);
    cursor.skip_blanks();
  }
  cursor.next();
  return values;
}

Answer read_call(Cursor& cursor, const Variables& variables, const std::string& name) {
  const absl::StatusOr<std::vector<Value>> arguments = read_arguments(cursor, variables, ')');
  return arguments.ok() ? call_function(name, *arguments) : Answer(arguments.status());
}

// Reads true, false, null, a function call, or a text without quotes.
Answer read_bare(Cursor& cursor, const Variables& variables) {
  const std::string name = cursor.read_name();
  if (name == "true" || name == "false") return Value::of(Json(name == "true"));
  if (name == "null") return Value::of(Json());
  if (!cursor.accept("(")) return Value::of(Json(name));
  RETURN_IF_ERROR(cursor.open());
  Answer value = read_call(cursor, variables, name);
  cursor.close();
  return value;
}

// Returns a single value unchanged, and several values as a list of numbers.
Answer list_of(std::vector<Value> values) {
  if (values.size() == 1) return std::move(values.front());
  Json list = Json::array();
  for (const Value& value : values) {
    if (!value.known()) return Value::unknown();
    ASSIGN_OR_RETURN(const Number number, number_of(value));
    list.push_back(json_of(number));
  }
  return Value::of(std::move(list));
}

Answer read_list(Cursor& cursor, const Variables& variables) {
  std::vector<Value> values;
  do {
    ASSIGN_OR_RETURN(Value value, read_sum(cursor, variables));
    values.push_back(std::move(value));
    cursor.skip_blanks();
  } while (cursor.accept(","));
  return list_of(std::move(values));
}

// Reads an expression in brackets. Precondition: the cursor is at the opening bracket.
Answer read_enclosed(Cursor& cursor, const Variables& variables) {
  LOCUS_DCHECK(cursor.peek() == '(' || cursor.peek() == '{');
  const absl::string_view end = cursor.next() == '(' ? ")" : "}";
  RETURN_IF_ERROR(cursor.open());
  Answer value = read_list(cursor, variables);
  cursor.close();
  RETURN_IF_ERROR(value.status());
  cursor.skip_blanks();
  return cursor.accept(end) ? std::move(value) : Answer(expected(absl::StrCat("`", end, "`"), cursor));
}

Answer read_primary(Cursor& cursor, const Variables& variables) {
  cursor.skip_blanks();
  const char c = cursor.peek();
  if (begins_number(cursor)) return read_numbers(cursor);
  if (c == '(' || c == '{') return read_enclosed(cursor, variables);
  if (c == '"' || c == '\'') return read_quoted_text(cursor, variables);
  if (begins_name(c)) return read_bare(cursor, variables);
  if (cursor.accept("$")) return read_variable(cursor, variables);
  return expected("a value", cursor);
}

Answer read_unary(Cursor& cursor, const Variables& variables) {
  bool negative = false;
  cursor.skip_blanks();
  while (!begins_number(cursor) && cursor.accept("-")) {
    negative = !negative;
    cursor.skip_blanks();
  }
  Answer value = read_primary(cursor, variables);
  if (!value.ok() || !negative) return value;
  return calculate('*', Value::of(Json(-1)), *value);
}

// Reads operands with `read`, separated by operators from `signs`, and applies the operators from left to right.
template <class Read>
Answer read_chain(Cursor& cursor, const Variables& variables, absl::string_view signs, Read read) {
  Answer left = read(cursor, variables);
  while (left.ok()) {
    cursor.skip_blanks();
    if (cursor.ended() || !absl::StrContains(signs, cursor.peek()) || absl::StartsWith(cursor.rest(), "->")) break;
    const char sign = cursor.next();
    ASSIGN_OR_RETURN(const Value right, read(cursor, variables));
    left = calculate(sign, *left, right);
  }
  return left;
}

Answer read_product(Cursor& cursor, const Variables& variables) {
  return read_chain(cursor, variables, "*/%", read_unary);
}

Answer read_sum(Cursor& cursor, const Variables& variables) {
  return read_chain(cursor, variables, "+-", read_product);
}

// Reads the index and the closing bracket of `[index]`, and applies the index to `value`. Precondition: the cursor is
// just after the opening bracket.
Answer read_entry(Cursor& cursor, const Variables& variables, const Value& value) {
  RETURN_IF_ERROR(cursor.open());
  const Answer index = read_sum(cursor, variables);
  cursor.close();
  RETURN_IF_ERROR(index.status());
  cursor.skip_blanks();
  if (!cursor.accept("]")) return expected("`]`", cursor);
  if (!index->known()) return Value::unknown();
  const absl::StatusOr<Number> number = number_of(*index);
  return number.ok() ? entry_of(value, *number) : Answer(number.status());
}

absl::Status not_defined(const std::string& name) {
  return absl::NotFoundError(
      absl::StrCat("$", name, " is not defined: set it with let, `-> ", name, "` or --set ", name, "=VALUE"));
}

// Reads any number of `.field` and `[index]`, and applies them to `value`.
Answer read_path(Cursor& cursor, const Variables& variables, Value value) {
  while (true) {
    Answer part = value;
    if (cursor.peek() == '.' && begins_name(cursor.peek(1))) {
      cursor.next();
      part = field_of(value, cursor.read_name());
    } else if (cursor.accept("[")) {
      part = read_entry(cursor, variables, value);
    } else {
      return value;
    }
    RETURN_IF_ERROR(part.status());
    value = *std::move(part);
  }
}

// Returns whether `value` must be replaced by a default: it is null or a column without rows.
bool is_missing(const Value& value) {
  if (value.kind == Value::Kind::kColumn && value.result->rows.empty()) return true;
  const absl::StatusOr<Json> json = value.known() ? plain(value) : Json(0);
  return json.ok() && json->is_null();
}

// Reads `name.path:-default}`. Precondition: the cursor is just after the opening brace.
Answer read_braced_variable(Cursor& cursor, const Variables& variables) {
  const std::string name = cursor.read_name();
  if (name.empty()) return expected("a name behind `${`", cursor);
  const Value* const variable = variables.find(name);
  // If the variable is not defined, parse its path nevertheless and ignore the result.
  ASSIGN_OR_RETURN(const Value value, read_path(cursor, variables, variable == nullptr ? Value::unknown() : *variable));
  if (cursor.accept("}")) return variable == nullptr ? Answer(not_defined(name)) : value;
  if (!cursor.accept(":-")) return expected("`}` or `:-`", cursor);
  const size_t length = cursor.rest().find('}');
  if (length == absl::string_view::npos) return absl::InvalidArgumentError("`${` is not closed: } is missing");
  std::string standby(cursor.rest().substr(0, length));
  cursor.move_to(cursor.at() + length + 1);
  return variable == nullptr || is_missing(value) ? Value::of(Json(std::move(standby))) : value;
}

}  // namespace

absl::StatusOr<Value> read_expression(Cursor& cursor, const Variables& variables) {
  return read_list(cursor, variables);
}

absl::StatusOr<Value> read_braces(Cursor& cursor, const Variables& variables) {
  return read_enclosed(cursor, variables);
}

absl::StatusOr<Value> read_variable(Cursor& cursor, const Variables& variables) {
  if (cursor.accept("{")) return read_braced_variable(cursor, variables);
  const std::string name = cursor.read_name();
  if (name.empty()) return expected("a name behind `$`", cursor);
  const Value* const variable = variables.find(name);
  if (variable == nullptr) return not_defined(name);
  return read_path(cursor, variables, *variable);
}

}  // namespace locus::cli
