#include "client/cli/script/functions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using Arguments = std::vector<Value>;
using Answer = absl::StatusOr<Value>;

Answer value_of(const absl::StatusOr<Number>& number) {
  RETURN_IF_ERROR(number.status());
  return Value::of(*number);
}

double dot_of(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Applies a function of one number, computed in double.
template <class Function>
Answer of_real(const Value& value, Function function) {
  const absl::StatusOr<Number> number = number_of(value);
  return number.ok() ? value_of(finite(function(real(*number)))) : number.status();
}

// Applies a function of one vector.
template <class Function>
Answer of_vector(const Value& value, Function function) {
  const absl::StatusOr<Vector> vector = vector_of(value);
  return vector.ok() ? function(*vector) : Answer(vector.status());
}

template <class Function>
Answer of_two_vectors(const Arguments& arguments, Function function) {
  ASSIGN_OR_RETURN(const Vector b, vector_of(arguments[1]));
  return of_vector(arguments[0], [&](const Vector& a) { return function(a, b); });
}

Answer finite_vector(const Vector& vector) {
  for (const double part : vector) {
    if (!std::isfinite(part)) return absl::OutOfRangeError("the result is not finite");
  }
  return Value::of(vector);
}

// Returns the absolute value of a number, or of each part of a vector.
Answer absolute(const Value& value) {
  ASSIGN_OR_RETURN(const Operand operand, operand_of(value));
  if (const Vector* const vector = std::get_if<Vector>(&operand)) {
    return Value::of(Vector{std::abs((*vector)[0]), std::abs((*vector)[1]), std::abs((*vector)[2])});
  }
  const Number& number = std::get<Number>(operand);
  return compare(number, absl::int128(0)) < 0 ? value_of(subtract(absl::int128(0), number)) : Answer(Value::of(number));
}

// Converts a number to an integer by `function`, so that it can be an index or an id. Integers are returned unchanged.
template <class Function>
Answer to_integer(const Value& value, Function function) {
  ASSIGN_OR_RETURN(const Number number, number_of(value));
  if (std::holds_alternative<absl::int128>(number)) return Value::of(number);
  const double whole = function(std::get<double>(number));
  if (std::abs(whole) >= 0x1p63) return absl::OutOfRangeError("the result needs more than 64 bits");
  return Value::of(Number(absl::int128(whole)));
}

// Returns the smallest (`sign` -1) or largest (`sign` 1) of all numbers and all parts of vectors in `arguments`.
Answer extreme(const Arguments& arguments, int sign) {
  std::vector<Number> numbers;
  for (const Value& argument : arguments) {
    ASSIGN_OR_RETURN(const Operand operand, operand_of(argument));
    if (const Number* const number = std::get_if<Number>(&operand)) {
      numbers.push_back(*number);
    } else {
      const Vector& vector = std::get<Vector>(operand);
      numbers.insert(numbers.end(), vector.begin(), vector.end());
    }
  }
  return Value::of(*std::max_element(numbers.begin(), numbers.end(),
                                     [sign](const Number& a, const Number& b) { return sign * compare(a, b) < 0; }));
}

Answer unit(const Vector& vector) {
  const double length = std::sqrt(dot_of(vector, vector));
  if (length == 0) return absl::OutOfRangeError("a zero vector has no direction");
  return finite_vector({vector[0] / length, vector[1] / length, vector[2] / length});
}

Answer cross(const Vector& a, const Vector& b) {
  return finite_vector({a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]});
}

struct Function {
  size_t least = 1;  // minimum number of arguments
  size_t most = 1;
  Answer (*call)(const Arguments& arguments) = nullptr;
};

const std::map<std::string, Function>& functions() {
  constexpr size_t kMany = 64;
  static const auto& table = *new std::map<std::string, Function>{
      {"abs", {1, 1, [](const Arguments& a) { return absolute(a[0]); }}},
      {"cos", {1, 1, [](const Arguments& a) { return of_real(a[0], [](double x) { return std::cos(x); }); }}},
      {"cross", {2, 2, [](const Arguments& a) { return of_two_vectors(a, cross); }}},
      {"dot",
       {2, 2,
        [](const Arguments& a) {
          return of_two_vectors(a, [](const Vector& u, const Vector& v) { return value_of(finite(dot_of(u, v))); });
        }}},
      {"floor", {1, 1, [](const Arguments& a) { return to_integer(a[0], [](double x) { return std::floor(x); }); }}},
      {"len",
       {1, 1,
        [](const Arguments& a) {
          const absl::StatusOr<uint64_t> size = size_of(a[0]);
          return size.ok() ? Answer(Value::of(Json(*size))) : Answer(size.status());
        }}},
      {"length",
       {1, 1,
        [](const Arguments& a) {
          return of_vector(a[0], [](const Vector& v) { return value_of(finite(std::sqrt(dot_of(v, v)))); });
        }}},
      {"max", {1, kMany, [](const Arguments& a) { return extreme(a, 1); }}},
      {"min", {1, kMany, [](const Arguments& a) { return extreme(a, -1); }}},
      {"radians",
       {1, 1,
        [](const Arguments& a) { return of_real(a[0], [](double x) { return x * (3.14159265358979323846 / 180); }); }}},
      {"round", {1, 1, [](const Arguments& a) { return to_integer(a[0], [](double x) { return std::round(x); }); }}},
      {"sin", {1, 1, [](const Arguments& a) { return of_real(a[0], [](double x) { return std::sin(x); }); }}},
      {"sqrt", {1, 1, [](const Arguments& a) { return of_real(a[0], [](double x) { return std::sqrt(x); }); }}},
      {"unit", {1, 1, [](const Arguments& a) { return of_vector(a[0], unit); }}}};
  return table;
}

}  // namespace

absl::StatusOr<Value> call_function(const std::string& name, const std::vector<Value>& arguments) {
  const auto found = functions().find(name);
  if (found == functions().end()) {
    return absl::NotFoundError(absl::StrCat(
        "there is no function ", name, "; the functions are ",
        absl::StrJoin(functions(), ", ", [](std::string* text, const auto& entry) { *text += entry.first; })));
  }
  const Function& function = found->second;
  if (arguments.size() < function.least || arguments.size() > function.most) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, "() takes ", function.least, function.most > function.least ? " or more" : "",
                     function.most == 1 ? " argument, not " : " arguments, not ", arguments.size()));
  }
  for (const Value& argument : arguments) {
    if (!argument.known()) return Value::unknown();
  }
  return function.call(arguments);
}

}  // namespace locus::cli
