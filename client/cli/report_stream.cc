#include "client/cli/report_stream.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/csv_text.h"

namespace locus::cli {
namespace {

std::vector<std::string> keys_of(const Json& row) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : row.items()) keys.push_back(key);
  return keys;
}

std::string entry_of(const std::string& key, const Json& value) {
  return absl::StrCat("  ", json_line(Json(key)), ": ", json_line(value));
}

std::string facts_line(const Json& facts) {
  std::vector<std::string> texts;
  for (const auto& [key, value] : facts.items()) texts.push_back(absl::StrCat(key, " ", table_cell(value)));
  return absl::StrJoin(texts, ", ");
}

}  // namespace

ReportStream::ReportStream(std::ostream& out, Format format, ReportShape shape)
    : out_(out), format_(format), shape_(std::move(shape)) {}

void ReportStream::begin(const Json& head) {
  head_ = head;
  if (format_ == Format::kCsv && !shape_.keys.empty()) out_ << csv_header(shape_.keys) << '\n';
  if (format_ != Format::kJson) return;
  out_ << "{\n";
  for (const auto& [key, value] : head.items()) out_ << entry_of(key, value) << ",\n";
  out_ << "  " << json_line(Json(shape_.rows_name)) << ": [";
}

void ReportStream::add(const Json& row) {
  const bool first = rows_++ == 0;
  switch (format_) {
    case Format::kTable:
      add_to_table(row);
      break;
    case Format::kJson:
      out_ << (first ? "\n    " : ",\n    ") << json_line(row);
      break;
    case Format::kNdjson:
      out_ << json_line(row) << '\n';
      break;
    case Format::kCsv:
      if (first && shape_.keys.empty()) {
        shape_.keys = keys_of(row);
        out_ << csv_header(shape_.keys) << '\n';
      }
      out_ << csv_line(row, shape_.keys) << '\n';
      break;
  }
}

void ReportStream::end(const Json& tail) {
  if (format_ == Format::kJson) {
    out_ << (rows_ == 0 ? "]" : "\n  ]");
    for (const auto& [key, value] : tail.items()) out_ << ",\n" << entry_of(key, value);
    out_ << "\n}\n";
  }
  if (format_ != Format::kTable) return;
  write_held();
  if (rows_ == 0) out_ << shape_.no_rows << '\n';
  head_.update(tail);
  if (!head_.empty()) out_ << facts_line(head_) << '\n';
}

void ReportStream::add_to_table(const Json& row) {
  if (rows_ == 1) {
    if (shape_.keys.empty()) shape_.keys = keys_of(row);
    held_.push_back(shape_.keys);
  }
  std::vector<std::string> cells;
  for (const std::string& key : shape_.keys) cells.push_back(row.contains(key) ? table_cell(row[key]) : "-");
  if (rows_ > shape_.width_rows) {
    write_cells(cells);
    return;
  }
  held_.push_back(std::move(cells));
  if (rows_ == shape_.width_rows) write_held();
}

void ReportStream::write_held() {
  for (const std::vector<std::string>& cells : held_) {
    widths_.resize(std::max(widths_.size(), cells.size()));
    for (size_t i = 0; i < cells.size(); ++i) widths_[i] = std::max(widths_[i], cells[i].size());
  }
  for (const std::vector<std::string>& cells : held_) write_cells(cells);
  held_.clear();
}

void ReportStream::write_cells(const std::vector<std::string>& cells) {
  std::string text;
  for (size_t i = 0; i < cells.size(); ++i) {
    absl::StrAppend(&text, i == 0 ? "" : "  ", cells[i]);
    if (i + 1 < cells.size()) text.append(widths_[i] - std::min(widths_[i], cells[i].size()), ' ');
  }
  out_ << text << '\n';
}

}  // namespace locus::cli
