#include "client/cli/rows/bulk/csv_rows.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

// Reads a quoted field. `rest` begins just after the opening quote and is advanced to just after the closing quote.
// Returns false if there is no closing quote.
bool take_quoted(absl::string_view& rest, std::string& field) {
  field.clear();
  while (true) {
    const size_t quote = rest.find('"');
    if (quote == absl::string_view::npos) return false;
    field.append(rest.data(), quote);
    rest.remove_prefix(quote + 1);
    if (rest.empty() || rest.front() != '"') return true;
    field.push_back('"');
    rest.remove_prefix(1);
  }
}

absl::Status stray_quote(size_t field) {
  return absl::InvalidArgumentError(absl::StrCat(
      "field ", field, ": a quote in the middle of it: put the whole field in quotes and write its quotes twice"));
}

bool same(const Slot& a, const Slot& b) { return a.field == b.field && a.part == b.part; }

}  // namespace

absl::Status split_csv_record(absl::string_view record, std::vector<std::string>& fields) {
  fields.clear();
  absl::string_view rest = record;
  while (true) {
    std::string field;
    const size_t field_number = fields.size() + 1;
    if (!rest.empty() && rest.front() == '"') {
      rest.remove_prefix(1);
      if (!take_quoted(rest, field)) return stray_quote(field_number);
      if (!rest.empty() && rest.front() != ',') return stray_quote(field_number);
    } else {
      const size_t end = std::min(rest.find(','), rest.size());
      const absl::string_view text = absl::StripAsciiWhitespace(rest.substr(0, end));
      if (text.find('"') != absl::string_view::npos) return stray_quote(field_number);
      field.assign(text.data(), text.size());
      rest.remove_prefix(end);
    }
    fields.push_back(std::move(field));
    if (rest.empty()) return absl::OkStatus();
    rest.remove_prefix(1);
  }
}

absl::Status CsvRows::read_header(absl::string_view record) {
  RETURN_IF_ERROR(split_csv_record(record, fields_));
  std::vector<Slot> slots;
  for (const std::string& name : fields_) {
    const std::optional<Slot> slot = find_slot(schema_, name);
    if (!slot || slot->part.has_value() == schema_[slot->field].parts.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat("unknown column '", absl::CEscape(name.substr(0, 40)),
                       "'; a header line names columns out of: ", known_columns(schema_)));
    }
    if (std::any_of(slots.begin(), slots.end(), [&](const Slot& other) { return same(other, *slot); })) {
      return absl::InvalidArgumentError(absl::StrCat("column ", slot_name(schema_, *slot), " is there twice"));
    }
    slots.push_back(*slot);
  }
  slots_ = std::move(slots);
  return check_complete();
}

absl::Status CsvRows::check_complete() const {
  for (size_t i = 0; i < schema_.size(); ++i) {
    const Field& field = schema_[i];
    const bool any = std::any_of(slots_.begin(), slots_.end(), [&](const Slot& slot) { return slot.field == i; });
    if (any && !field.option.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("the column ", field.name, " and the option ", field.option,
                                                     " are both given: leave one of them out"));
    }
    if (!any && !field.required) continue;
    for (size_t part = 0; part < field.size(); ++part) {
      const Slot slot = field.parts.empty() ? Slot{i} : Slot{i, part};
      if (std::any_of(slots_.begin(), slots_.end(), [&](const Slot& other) { return same(other, slot); })) continue;
      return absl::InvalidArgumentError(absl::StrCat("no column ", slot_name(schema_, slot),
                                                     "; a header line names columns out of: ", known_columns(schema_)));
    }
  }
  return absl::OkStatus();
}

absl::Status CsvRows::read_row(absl::string_view record, uint64_t line, RowBuilder& builder, RowBatch& batch) {
  RETURN_IF_ERROR(split_csv_record(record, fields_));
  if (fields_.size() != slots_.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("has ", fields_.size(), " fields, the header names ", slots_.size()));
  }
  builder.start();
  for (size_t i = 0; i < fields_.size(); ++i) {
    if (fields_[i].empty()) continue;
    RETURN_IF_ERROR(builder.put_text(slots_[i], fields_[i]));
  }
  return builder.finish(line, batch);
}

}  // namespace locus::cli
