#include "client/cli/rows/bulk/csv_record.h"

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

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

}  // namespace locus::cli
