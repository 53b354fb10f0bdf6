// Value of a script's variable: a number, a text, a list, a result of a command, or a column of its rows. For
// expressions. Plain values; functions without state. Texts that read as numbers, as ids in answers do, count as
// numbers.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_VALUE_H_
#define LOCUS_CLIENT_CLI_SCRIPT_VALUE_H_

#include <array>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/output.h"
#include "client/cli/script/number.h"

namespace locus::cli {

// A vector's parts.
using Vector = std::array<double, 3>;

struct Value {
  enum class Kind {
    kUnknown,  // known only when the script runs: while it is checked
    kPlain,    // `data`
    kResult,   // `result`
    kColumn    // `column` of the rows of `result`; one row counts as its entry
  };

  static Value unknown() { return {.kind = Kind::kUnknown}; }
  static Value of(Json json) { return {.data = std::move(json)}; }
  static Value of(const Number& number) { return of(json_of(number)); }
  static Value of(const Vector& vector) { return of(Json(vector)); }
  static Value of(std::shared_ptr<const Report> report) { return {.kind = Kind::kResult, .result = std::move(report)}; }
  bool known() const { return kind != Kind::kUnknown; }

  Kind kind = Kind::kPlain;
  Json data = nullptr;
  std::shared_ptr<const Report> result = nullptr;
  std::string column = {};
};

// A fact of a result's head, a column of its rows, their `count`, or the rows themselves under their name; an entry of
// a record. NOT_FOUND naming what there is instead.
absl::StatusOr<Value> field_of(const Value& value, const std::string& name);
// Entry of a list or row of a column, from 0. OUT_OF_RANGE beyond its end.
absl::StatusOr<Value> entry_of(const Value& value, const Number& index);
// Number of entries of a list or rows of a column, bytes of a text.
absl::StatusOr<uint64_t> size_of(const Value& value);

// A column of one row as its entry, another one as a list. INVALID_ARGUMENT for a whole result.
absl::StatusOr<Json> plain(const Value& value);

// Operand of a calculation. The conversions return INVALID_ARGUMENT naming the value's kind if it is another one.
using Operand = std::variant<Number, Vector>;
absl::StatusOr<Operand> operand_of(const Value& value);
absl::StatusOr<Number> number_of(const Value& value);
absl::StatusOr<Vector> vector_of(const Value& value);

// Returns the value as a word of a line: lists with commas, doubles in the fewest digits, null as "null".
absl::StatusOr<std::string> text_of(const Value& value);
// For messages: the same, cut to a readable length; never fails.
std::string shown(const Value& value);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_VALUE_H_
