// Value in a script: JSON data (such as a number, a text or a list), the result of a command, or one column of a
// result's rows. For expressions. Plain values; functions without state. Texts that are numbers, such as ids in
// answers, are treated as numbers.
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

// Three parts of a vector: x, y, z.
using Vector = std::array<double, 3>;

// NOLINTNEXTLINE(bugprone-exception-escape): the move constructor of Json is noexcept; it contains an assertion
struct Value {
  enum class Kind {
    kUnknown,  // unknown, because the script is only checked
    kPlain,    // `data`
    kResult,   // `result`
    kColumn    // `column` of the rows of `result`; a column with one row is treated as the entry of this row
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

// Returns a field of a result or of a record. The fields of a result are the entries of its head, the columns of its
// rows, the number of rows as `count`, and all rows under the name Report::rows_name. If the list of rows is empty, its
// columns are not known, so any other name is a column without rows. Returns NOT_FOUND with the existing names if there
// is no such field.
absl::StatusOr<Value> field_of(const Value& value, const std::string& name);
// Returns an entry of a list or a row of a column, counted from 0. Returns OUT_OF_RANGE beyond the end.
absl::StatusOr<Value> entry_of(const Value& value, const Number& index);
// Returns the number of entries of a list, of rows of a column, or of bytes of a text.
absl::StatusOr<uint64_t> size_of(const Value& value);

// Returns a value as JSON: a column with one row as the entry of this row, any other column as a list. Returns
// INVALID_ARGUMENT for a whole result.
absl::StatusOr<Json> plain(const Value& value);

// Operand of a calculation. The conversions return INVALID_ARGUMENT, with a description of the value, if the value does
// not have the requested type.
using Operand = std::variant<Number, Vector>;
absl::StatusOr<Operand> operand_of(const Value& value);
absl::StatusOr<Number> number_of(const Value& value);
absl::StatusOr<Vector> vector_of(const Value& value);

// Returns the value as a word of a line: lists with commas, doubles in the fewest digits, null as "null".
absl::StatusOr<std::string> text_of(const Value& value);
// Returns text_of(), truncated to a readable length, for messages; never fails.
std::string shown(const Value& value);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_VALUE_H_
