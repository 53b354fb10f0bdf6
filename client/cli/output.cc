#include "client/cli/output.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace locus::cli {
namespace {

std::string cell_text(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  std::vector<std::string> parts;
  if (value.is_array()) {
    for (const Json& part : value) parts.push_back(part.is_string() ? part.get<std::string>() : part.dump());
  } else if (value.is_object()) {
    for (const auto& [key, part] : value.items()) parts.push_back(absl::StrCat(key, "=", cell_text(part)));
  } else {
    return value.dump();
  }
  return parts.empty() ? "-" : absl::StrJoin(parts, ",");
}

std::vector<std::string> keys_of(const Json& row) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : row.items()) keys.push_back(key);
  return keys;
}

void write_lines(std::ostream& out, const std::vector<std::vector<std::string>>& lines) {
  std::vector<size_t> widths;
  for (const std::vector<std::string>& line : lines) {
    widths.resize(std::max(widths.size(), line.size()));
    for (size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], line[i].size());
  }
  for (const std::vector<std::string>& line : lines) {
    std::string text;
    for (size_t i = 0; i < line.size(); ++i) {
      absl::StrAppend(&text, i == 0 ? "" : "  ", line[i]);
      if (i + 1 < line.size()) text.append(widths[i] - line[i].size(), ' ');
    }
    out << text << '\n';
  }
}

void write_rows(std::ostream& out, const Report& report) {
  if (report.rows.empty()) {
    out << report.no_rows << '\n';
    return;
  }
  const std::vector<std::string> keys = keys_of(report.rows.front());
  std::vector<std::vector<std::string>> lines = {keys};
  for (const Json& row : report.rows) {
    std::vector<std::string>& line = lines.emplace_back();
    for (const std::string& key : keys) line.push_back(row.contains(key) ? cell_text(row[key]) : "-");
  }
  write_lines(out, lines);
}

void write_table(std::ostream& out, const Report& report) {
  std::vector<std::vector<std::string>> facts;
  for (const auto& [key, value] : report.head.items()) facts.push_back({key, cell_text(value)});
  if (report.rows_name.empty()) {
    write_lines(out, facts);
    return;
  }
  write_rows(out, report);
  if (facts.empty()) return;
  out << absl::StrJoin(facts, ", ", [](std::string* text, const std::vector<std::string>& fact) {
    absl::StrAppend(text, fact[0], " ", fact[1]);
  }) << '\n';
}

// A server's text may hold anything; what is not UTF-8 is replaced rather than thrown at.
std::string line_of(const Json& json) {
  return json.dump(-1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
}

// Indented by hand: an entry of the head and a row take a line each, however many numbers they hold.
void write_document(std::ostream& out, const Report& report) {
  std::vector<std::string> entries;
  for (const auto& [key, value] : report.head.items()) {
    entries.push_back(absl::StrCat("  ", line_of(Json(key)), ": ", line_of(value)));
  }
  if (!report.rows_name.empty()) {
    const std::string rows = absl::StrJoin(
        report.rows, ",\n    ", [](std::string* text, const Json& row) { absl::StrAppend(text, line_of(row)); });
    entries.push_back(absl::StrCat("  ", line_of(Json(report.rows_name)), ": [",
                                   rows.empty() ? "" : absl::StrCat("\n    ", rows, "\n  "), "]"));
  }
  out << "{\n" << absl::StrJoin(entries, ",\n") << "\n}\n";
}

}  // namespace

void write_report(std::ostream& out, Format format, const Report& report) {
  switch (format) {
    case Format::kTable:
      write_table(out, report);
      break;
    case Format::kJson:
      write_document(out, report);
      break;
    case Format::kNdjson:
      if (report.rows_name.empty()) out << line_of(report.head) << '\n';
      for (const Json& row : report.rows) out << line_of(row) << '\n';
      break;
  }
}

Json id_json(uint64_t id) { return absl::StrCat(id); }

Json float_json(float value) {
  if (!std::isfinite(value)) return nullptr;
  std::array<char, 32> text{};
  const std::to_chars_result end = std::to_chars(text.data(), text.data() + text.size(), value);
  double shortest = 0;
  std::from_chars(text.data(), end.ptr, shortest);
  return shortest;
}

Json floats_json(absl::Span<const float> values) {
  Json array = Json::array();
  for (const float value : values) array.push_back(float_json(value));
  return array;
}

Json doubles_json(absl::Span<const double> values) {
  Json array = Json::array();
  for (const double value : values) array.push_back(value);
  return array;
}

}  // namespace locus::cli
