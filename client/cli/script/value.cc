#include "client/cli/script/value.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr size_t kMaxShownBytes = 200;

bool has_column(const Report& report, const std::string& name) {
  return !report.rows.empty() && report.rows.front().is_object() && report.rows.front().contains(name);
}

std::string fields_of(const Report& report) {
  std::vector<std::string> names;
  for (const auto& [key, value] : report.head.items()) names.push_back(key);
  if (!report.rows_name.empty()) {
    names.push_back(report.rows_name);
    names.emplace_back("count");
  }
  if (!report.rows.empty()) {
    for (const auto& [key, value] : report.rows.front().items()) names.push_back(key);
  }
  return absl::StrJoin(names, ", ");
}

absl::StatusOr<Value> field_of_result(const Value& value, const std::string& name) {
  const Report& report = *value.result;
  if (report.head.contains(name)) return Value::of(report.head[name]);
  if (has_column(report, name)) return Value{.kind = Value::Kind::kColumn, .result = value.result, .column = name};
  if (!report.rows_name.empty()) {
    if (name == report.rows_name) return Value::of(Json(report.rows));
    if (name == "count") return Value::of(Json(report.rows.size()));
    // A report without rows does not list its columns, so treat every unknown name as a column without rows.
    if (report.rows.empty()) return Value{.kind = Value::Kind::kColumn, .result = value.result, .column = name};
  }
  return absl::NotFoundError(absl::StrCat("there is no field ", name, "; there are ", fields_of(report)));
}

Json cell(const Json& row, const std::string& column) { return row.contains(column) ? row[column] : Json(); }

std::optional<Number> scalar_number(const Json& json) {
  if (json.is_string()) return parse_number(json.get_ref<const std::string&>());
  return number_from(json);
}

std::optional<Vector> as_vector(const Json& json) {
  if (json.is_string()) {
    const std::vector<std::string> parts = absl::StrSplit(json.get_ref<const std::string&>(), ',');
    return parts.size() == 3 ? as_vector(Json(parts)) : std::nullopt;
  }
  if (!json.is_array() || json.size() != 3) return std::nullopt;
  Vector vector{};
  for (size_t i = 0; i < 3; ++i) {
    const std::optional<Number> part = scalar_number(json[i]);
    if (!part) return std::nullopt;
    vector[i] = real(*part);
  }
  return vector;
}

std::string text_of_json(const Json& json) {
  if (json.is_string()) return json.get<std::string>();
  if (const std::optional<Number> number = number_from(json)) return text_of(*number);
  if (!json.is_array()) return json.dump(-1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
  return absl::StrJoin(json, ",", [](std::string* text, const Json& part) {
    absl::StrAppend(text, part.is_array() || part.is_object() ? part.dump() : text_of_json(part));
  });
}

absl::Status is_something_else(const Value& value, absl::string_view wanted) {
  return absl::InvalidArgumentError(absl::StrCat(shown(value), " is not ", wanted));
}

// Returns plain(value), except for a column that has no row or several rows: then returns INVALID_ARGUMENT, because it
// is not clear which entry is meant.
absl::StatusOr<Json> single(const Value& value) {
  if (value.kind == Value::Kind::kColumn && value.result->rows.size() != 1) {
    return absl::InvalidArgumentError(absl::StrCat(value.column, " has ", value.result->rows.size(),
                                                   " rows: choose one, as in ", value.column, "[0]"));
  }
  return plain(value);
}

}  // namespace

absl::StatusOr<Value> field_of(const Value& value, const std::string& name) {
  if (!value.known()) return value;
  if (value.kind == Value::Kind::kResult) return field_of_result(value, name);
  ASSIGN_OR_RETURN(const Json json, single(value));
  if (!json.is_object()) return is_something_else(value, absl::StrCat("a record: it has no field ", name));
  if (json.contains(name)) return Value::of(json[name]);
  std::vector<std::string> names;
  for (const auto& [key, entry] : json.items()) names.push_back(key);
  return absl::NotFoundError(absl::StrCat("there is no field ", name, "; there are ", absl::StrJoin(names, ", ")));
}

absl::StatusOr<Value> entry_of(const Value& value, const Number& index) {
  if (!value.known()) return value;
  if (value.kind == Value::Kind::kPlain && !value.data.is_array()) return is_something_else(value, "a list");
  ASSIGN_OR_RETURN(const uint64_t size, size_of(value));
  const absl::int128* const place = std::get_if<absl::int128>(&index);
  if (place == nullptr || *place < 0 || *place >= absl::int128(size)) {
    return absl::OutOfRangeError(absl::StrCat("there is no entry [", text_of(index), "] among ", size));
  }
  const auto i = static_cast<size_t>(*place);
  if (value.kind == Value::Kind::kColumn) return Value::of(cell(value.result->rows[i], value.column));
  return Value::of(value.data[i]);
}

absl::StatusOr<uint64_t> size_of(const Value& value) {
  if (value.kind == Value::Kind::kColumn) return value.result->rows.size();
  if (value.kind == Value::Kind::kPlain && value.data.is_array()) return value.data.size();
  if (value.kind == Value::Kind::kPlain && value.data.is_string()) {
    return value.data.get_ref<const std::string&>().size();
  }
  return is_something_else(value, "a list");
}

absl::StatusOr<Json> plain(const Value& value) {
  if (value.kind == Value::Kind::kPlain) return value.data;
  if (value.kind == Value::Kind::kResult) {
    return absl::InvalidArgumentError(
        absl::StrCat("a result has several fields: name one of them: ", fields_of(*value.result)));
  }
  const std::vector<Json>& rows = value.result->rows;
  if (rows.size() == 1) return cell(rows.front(), value.column);
  Json list = Json::array();
  for (const Json& row : rows) list.push_back(cell(row, value.column));
  return list;
}

absl::StatusOr<Operand> operand_of(const Value& value) {
  ASSIGN_OR_RETURN(const Json json, single(value));
  if (const std::optional<Number> number = scalar_number(json)) return Operand(*number);
  if (const std::optional<Vector> vector = as_vector(json)) return Operand(*vector);
  return is_something_else(value, "a number or a vector");
}

absl::StatusOr<Number> number_of(const Value& value) {
  ASSIGN_OR_RETURN(const Operand operand, operand_of(value));
  const Number* const number = std::get_if<Number>(&operand);
  return number != nullptr ? absl::StatusOr<Number>(*number) : is_something_else(value, "a number");
}

absl::StatusOr<Vector> vector_of(const Value& value) {
  ASSIGN_OR_RETURN(const Operand operand, operand_of(value));
  const Vector* const vector = std::get_if<Vector>(&operand);
  return vector != nullptr ? absl::StatusOr<Vector>(*vector) : is_something_else(value, "a vector x,y,z");
}

absl::StatusOr<std::string> text_of(const Value& value) {
  ASSIGN_OR_RETURN(const Json json, plain(value));
  return text_of_json(json);
}

std::string shown(const Value& value) {
  if (!value.known()) return "an unknown value";
  absl::StatusOr<std::string> text = text_of(value);
  if (!text.ok()) return "a whole result";
  if (value.kind == Value::Kind::kColumn && value.result->rows.empty()) return "empty: there are no rows";
  if (text->empty()) return "an empty text or list";
  if (text->size() > kMaxShownBytes) *text = absl::StrCat(text->substr(0, kMaxShownBytes), " ...");
  return *std::move(text);
}

}  // namespace locus::cli
