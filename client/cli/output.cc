#include "client/cli/output.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/csv_text.h"
#include "client/cli/report_stream.h"

namespace locus::cli {
namespace {

// Returns the keys of all rows, in the order in which they first appear.
std::vector<std::string> keys_of_all(const std::vector<Json>& rows) {
  std::vector<std::string> keys;
  std::set<std::string> seen;
  for (const Json& row : rows) {
    for (const auto& [key, value] : row.items()) {
      if (seen.insert(key).second) keys.push_back(key);
    }
  }
  return keys;
}

void write_rows(std::ostream& out, Format format, const Report& report) {
  ReportShape shape = {.rows_name = report.rows_name, .keys = report.keys, .no_rows = report.no_rows};
  if (format == Format::kCsv && shape.keys.empty()) shape.keys = keys_of_all(report.rows);
  ReportStream stream(out, format, std::move(shape));
  stream.begin(report.head);
  for (const Json& row : report.rows) stream.add(row);
  stream.end();
}

void write_facts_table(std::ostream& out, const Json& head) {
  size_t width = 0;
  for (const auto& [key, value] : head.items()) width = std::max(width, key.size());
  for (const auto& [key, value] : head.items()) {
    out << key << std::string(width - key.size() + 2, ' ') << table_cell(value) << '\n';
  }
}

void write_facts(std::ostream& out, Format format, const Json& head) {
  std::vector<std::string> entries;
  switch (format) {
    case Format::kTable:
      write_facts_table(out, head);
      break;
    case Format::kJson:
      for (const auto& [key, value] : head.items()) {
        entries.push_back(absl::StrCat("  ", json_line(Json(key)), ": ", json_line(value)));
      }
      out << "{\n" << absl::StrJoin(entries, ",\n") << "\n}\n";
      break;
    case Format::kNdjson:
      out << json_line(head) << '\n';
      break;
    case Format::kCsv:
      out << csv_header(keys_of_all({head})) << '\n' << csv_line(head, keys_of_all({head})) << '\n';
      break;
  }
}

}  // namespace

void write_report(std::ostream& out, Format format, const Report& report) {
  if (report.rows_name.empty()) {
    write_facts(out, format, report.head);
  } else {
    write_rows(out, format, report);
  }
}

std::string json_line(const Json& value) {
  return value.dump(-1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
}

std::string table_cell(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  std::vector<std::string> parts;
  if (value.is_array()) {
    for (const Json& part : value) parts.push_back(part.is_string() ? part.get<std::string>() : json_line(part));
  } else if (value.is_object()) {
    for (const auto& [key, part] : value.items()) parts.push_back(absl::StrCat(key, "=", table_cell(part)));
  } else {
    return value.dump();
  }
  return parts.empty() ? "-" : absl::StrJoin(parts, ",");
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
