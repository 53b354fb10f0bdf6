#include "client/cli/script/arithmetic.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using Answer = absl::StatusOr<Value>;

absl::StatusOr<Number> of_numbers(char sign, const Number& x, const Number& y) {
  switch (sign) {
    case '+':
      return add(x, y);
    case '-':
      return subtract(x, y);
    case '*':
      return multiply(x, y);
    case '/':
      return divide(x, y);
    default:
      return modulo(x, y);
  }
}

// Applies the operator `sign` to two vectors, or to a vector and a number, part by part.
Answer by_parts(char sign, const Operand& a, const Operand& b) {
  const auto part = [](const Operand& operand, size_t i) {
    const Vector* const vector = std::get_if<Vector>(&operand);
    return vector != nullptr ? Number((*vector)[i]) : Number(real(std::get<Number>(operand)));
  };
  Vector result{};
  for (size_t i = 0; i < result.size(); ++i) {
    ASSIGN_OR_RETURN(const Number value, of_numbers(sign, part(a, i), part(b, i)));
    result[i] = real(value);
  }
  return Value::of(result);
}

}  // namespace

absl::StatusOr<Value> calculate(char sign, const Value& left, const Value& right) {
  if (!left.known() || !right.known()) return Value::unknown();
  ASSIGN_OR_RETURN(const Operand a, operand_of(left));
  ASSIGN_OR_RETURN(const Operand b, operand_of(right));
  const Number* const x = std::get_if<Number>(&a);
  const Number* const y = std::get_if<Number>(&b);
  if (x != nullptr && y != nullptr) {
    const absl::StatusOr<Number> number = of_numbers(sign, *x, *y);
    return number.ok() ? Answer(Value::of(*number)) : Answer(number.status());
  }
  const bool scales = (sign == '*' && (x == nullptr) != (y == nullptr)) || (sign == '/' && y != nullptr);
  const bool moves = (sign == '+' || sign == '-') && x == nullptr && y == nullptr;
  if (scales || moves) return by_parts(sign, a, b);
  return absl::InvalidArgumentError(absl::StrCat("`", std::string(1, sign), "` does not go with ", shown(left), " and ",
                                                 shown(right),
                                                 ": two vectors can be combined by + and -, "
                                                 "dot() and cross(), a vector and a number by * and /"));
}

}  // namespace locus::cli
