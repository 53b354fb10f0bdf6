#include "client/cli/rows/bulk/row_schema.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"

namespace locus::cli {
namespace {

bool is_named(const Field& field, const std::string& name) {
  return field.name == name || std::find(field.aliases.begin(), field.aliases.end(), name) != field.aliases.end();
}

}  // namespace

std::optional<Slot> find_slot(const RowSchema& schema, absl::string_view name) {
  const std::string normalized = absl::StrReplaceAll(name, {{"-", "_"}});
  const size_t dot =
      normalized.size() > 2 && normalized[normalized.size() - 2] == '.' ? normalized.size() - 2 : std::string::npos;
  for (size_t i = 0; i < schema.size(); ++i) {
    if (is_named(schema[i], normalized)) return Slot{i};
    if (dot == std::string::npos || !is_named(schema[i], normalized.substr(0, dot))) continue;
    const size_t part = schema[i].parts.find(normalized.back());
    if (part != std::string::npos) return Slot{i, part};
  }
  return std::nullopt;
}

std::string slot_name(const RowSchema& schema, const Slot& slot) {
  const Field& field = schema[slot.field];
  if (!slot.part) return field.name;
  return absl::StrCat(field.name, ".", field.parts.substr(*slot.part, 1));
}

std::string known_columns(const RowSchema& schema) {
  std::vector<std::string> names;
  for (size_t i = 0; i < schema.size(); ++i) {
    if (schema[i].parts.empty()) names.push_back(schema[i].name);
    for (size_t part = 0; part < schema[i].parts.size(); ++part) names.push_back(slot_name(schema, {i, part}));
  }
  return absl::StrJoin(names, ", ");
}

bool RowColumn::any() const {
  return std::any_of(given.begin(), given.end(), [](uint8_t flag) { return flag != 0; });
}

bool RowColumn::all() const {
  return std::all_of(given.begin(), given.end(), [](uint8_t flag) { return flag != 0; });
}

}  // namespace locus::cli
