#include "client/cli/rows/bulk/csv_rows.h"

#include <algorithm>
#include <optional>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "client/cli/rows/bulk/csv_record.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

bool same(const Slot& a, const Slot& b) { return a.field == b.field && a.part == b.part; }

}  // namespace

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
      return absl::InvalidArgumentError(
          absl::StrCat("column ", field.name, " is there and ", field.option, " is given: leave one of them out"));
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
