#include "client/cli/csv_text.h"

#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"

namespace locus::cli {
namespace {

// Returns one letter for each column into which `key` is split, for example "xyz"; empty if `key` is a single column.
const std::string& parts_of(const std::string& key) {
  static const auto& parts = *new std::map<std::string, std::string>{
      {"at", "xyz"},    {"axis", "xyz"},     {"dir", "xyz"}, {"from", "xyz"},       {"half", "xyz"},
      {"max", "xyz"},   {"min", "xyz"},      {"uv", "uv"},   {"rotation", "xyzw"},  {"normal", "xyz"},
      {"point", "xyz"}, {"position", "xyz"}, {"to", "xyz"},  {"translation", "xyz"}};
  static const auto& none = *new std::string;
  const auto found = parts.find(key);
  return found == parts.end() ? none : found->second;
}

std::string quoted_if_needed(const std::string& text) {
  const bool plain =
      !text.empty() && text.find_first_of(",\"\r\n") == std::string::npos && text.front() != ' ' && text.back() != ' ';
  return plain ? text : absl::StrCat("\"", absl::StrReplaceAll(text, {{"\"", "\"\""}}), "\"");
}

std::string cell(const Json& value) {
  if (value.is_null()) return "";
  if (value.is_string()) return quoted_if_needed(value.get<std::string>());
  return quoted_if_needed(json_line(value));
}

// Appends `parts` cells for a key that is split into columns. Some reports use the same key for another type of value:
// if `value` is not a vector of that size, it is written whole into the first cell, and the other cells stay empty.
void append_parts(const Json& value, size_t parts, std::vector<std::string>& cells) {
  const bool vector = value.is_array() && value.size() == parts;
  for (size_t i = 0; i < parts; ++i) cells.push_back(vector ? cell(value[i]) : i == 0 ? cell(value) : "");
}

}  // namespace

std::string csv_header(const std::vector<std::string>& keys) {
  std::vector<std::string> names;
  for (const std::string& key : keys) {
    const std::string& parts = parts_of(key);
    if (parts.empty()) names.push_back(quoted_if_needed(key));
    for (const char part : parts) names.push_back(absl::StrCat(key, ".", std::string(1, part)));
  }
  return absl::StrJoin(names, ",");
}

std::string csv_line(const Json& row, const std::vector<std::string>& keys) {
  std::vector<std::string> cells;
  for (const std::string& key : keys) {
    const auto found = row.find(key);
    const Json value = found == row.end() ? Json() : *found;
    const std::string& parts = parts_of(key);
    if (parts.empty()) {
      cells.push_back(cell(value));
    } else {
      append_parts(value, parts.size(), cells);
    }
  }
  return absl::StrJoin(cells, ",");
}

}  // namespace locus::cli
