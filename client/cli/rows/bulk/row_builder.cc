#include "client/cli/rows/bulk/row_builder.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <system_error>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include "core/base/limits.h"

namespace locus::cli {
namespace {

constexpr size_t kShownBytes = 40;

bool holds_integer(FieldKind kind) {
  return kind == FieldKind::kId || kind == FieldKind::kBits || kind == FieldKind::kWord;
}

// Returns `text` in quotes, truncated to kShownBytes, for an error message.
std::string quoted_excerpt(absl::string_view text) {
  if (text.size() <= kShownBytes) return absl::StrCat("'", absl::CEscape(text), "'");
  return absl::StrCat("'", absl::CEscape(text.substr(0, kShownBytes)), "...'");
}

template <class T, class... How>
std::optional<T> parse_exactly(absl::string_view text, How... how) {
  T value{};
  const char* const end = text.data() + text.size();
  const std::from_chars_result result = std::from_chars(text.data(), end, value, how...);
  if (result.ec != std::errc() || result.ptr != end) return std::nullopt;
  return value;
}

std::optional<double> read_number(absl::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return parse_exactly<double>(text);
}

std::optional<uint64_t> read_integer(absl::string_view text) {
  if (absl::ConsumePrefix(&text, "0x") || absl::ConsumePrefix(&text, "0X")) return parse_exactly<uint64_t>(text, 16);
  return parse_exactly<uint64_t>(text, 10);
}

// Returns the reason why `value` is not allowed for this kind of field; empty if it is allowed.
std::string fault_of(FieldKind kind, double value) {
  if (kind == FieldKind::kDistance) {
    return value >= 0 ? "" : absl::StrCat(value, " is not 0 or more");  // NaN is refused, too
  }
  if (!std::isfinite(value)) return absl::StrCat(value, " is not finite");
  if (kind == FieldKind::kCoordinate && std::abs(value) > limits::kMaxCoordinate) {
    return absl::StrCat(value, " is beyond ", limits::kMaxCoordinate);
  }
  if (std::abs(value) > std::numeric_limits<float>::max()) return absl::StrCat(value, " is more than a float holds");
  return "";
}

}  // namespace

RowBuilder::RowBuilder(const RowSchema& schema) : schema_(schema), values_(schema.size()) {
  for (size_t i = 0; i < schema.size(); ++i) values_[i].numbers.resize(schema[i].size());
}

RowBatch RowBuilder::empty_batch(uint64_t first_row) const {
  RowBatch batch;
  batch.columns.resize(schema_.size());
  batch.first_row = first_row;
  return batch;
}

void RowBuilder::start() {
  for (Value& value : values_) {
    std::fill(value.numbers.begin(), value.numbers.end(), 0);
    value.integer = 0;
    value.text.clear();
    value.parts_given = 0;
  }
}

absl::Status RowBuilder::wrong(const Slot& slot, absl::string_view what) const {
  return absl::InvalidArgumentError(absl::StrCat(slot_name(schema_, slot), ": ", what));
}

absl::Status RowBuilder::store(const Slot& slot, double number, uint64_t integer) {
  Value& value = values_[slot.field];
  const uint32_t bit = 1u << slot.part.value_or(0);
  if ((value.parts_given & bit) != 0) return wrong(slot, "is given twice");
  value.parts_given |= bit;
  value.numbers[slot.part.value_or(0)] = number;
  value.integer = integer;
  return absl::OkStatus();
}

absl::Status RowBuilder::put_text(const Slot& slot, absl::string_view text) {
  const Field& field = schema_[slot.field];
  if (field.kind == FieldKind::kJson) {
    values_[slot.field].text = std::string(text);
    return store(slot, 0, 0);
  }
  if (field.kind == FieldKind::kWord) {
    const auto word = std::find(field.words.begin(), field.words.end(), text);
    if (word != field.words.end()) return store(slot, 0, static_cast<uint64_t>(word - field.words.begin()));
    return wrong(slot, absl::StrCat(quoted_excerpt(text), " is none of ", absl::StrJoin(field.words, ", ")));
  }
  if (holds_integer(field.kind)) {
    const std::optional<uint64_t> integer = read_integer(text);
    if (integer) return put_integer(slot, *integer);
    return wrong(slot, absl::StrCat(quoted_excerpt(text), " is no whole number from 0 to 18446744073709551615"));
  }
  const std::optional<double> number = read_number(text);
  return number ? put_number(slot, *number) : wrong(slot, absl::StrCat(quoted_excerpt(text), " is no number"));
}

absl::Status RowBuilder::put_number(const Slot& slot, double value) {
  const FieldKind kind = schema_[slot.field].kind;
  if (kind == FieldKind::kJson) return wrong(slot, absl::StrCat(value, " is no list"));
  if (holds_integer(kind))
    return wrong(slot, absl::StrCat(value, " is no whole number from 0 to 18446744073709551615"));
  const std::string fault = fault_of(kind, value);
  return fault.empty() ? store(slot, value, 0) : wrong(slot, fault);
}

absl::Status RowBuilder::put_integer(const Slot& slot, uint64_t value) {
  const FieldKind kind = schema_[slot.field].kind;
  if (!holds_integer(kind)) return put_number(slot, static_cast<double>(value));
  if (kind == FieldKind::kWord) return wrong(slot, absl::StrCat(value, " is no word"));
  if (kind == FieldKind::kBits && value > std::numeric_limits<uint32_t>::max()) {
    return wrong(slot, absl::StrCat(value, " is beyond 4294967295"));
  }
  return store(slot, 0, value);
}

absl::Status RowBuilder::finish(uint64_t line, RowBatch& batch) {
  for (size_t i = 0; i < schema_.size(); ++i) {
    const uint32_t given = values_[i].parts_given;
    if (given == 0 && schema_[i].required) return wrong({i}, "is missing");
    if (given != 0 && !schema_[i].needs.empty())
      if (const std::optional<Slot> other = find_slot(schema_, schema_[i].needs);
          other && values_[other->field].parts_given == 0)
        return wrong({i}, absl::StrCat("needs a value of ", schema_[i].needs, " in the same row"));
    if (given == 0 || schema_[i].parts.empty()) continue;
    for (size_t part = 0; part < schema_[i].size(); ++part) {
      if ((given & (1u << part)) == 0) return wrong({i, part}, "is missing, but other parts are given");
    }
  }
  for (size_t i = 0; i < schema_.size(); ++i) {
    RowColumn& column = batch.columns[i];
    const Value& value = values_[i];
    column.given.push_back(value.parts_given != 0 ? 1 : 0);
    if (holds_integer(schema_[i].kind)) {
      column.integers.push_back(value.integer);
    } else if (schema_[i].kind == FieldKind::kJson) {
      column.texts.push_back(value.text);
    } else {
      column.numbers.insert(column.numbers.end(), value.numbers.begin(), value.numbers.end());
    }
  }
  batch.lines.push_back(line);
  return absl::OkStatus();
}

}  // namespace locus::cli
