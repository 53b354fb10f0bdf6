#include "client/cli/rows/bulk/sent_rows.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace locus::cli {

std::optional<uint64_t> SentRows::line_of(absl::string_view field, size_t index) const {
  const absl::string_view list_name = field.substr(0, field.find('.'));
  const size_t open = list_name.find('[');
  size_t list = 0;
  if (open != absl::string_view::npos) {
    const size_t close = list_name.find(']', open);
    if (close == absl::string_view::npos) return std::nullopt;
    if (!absl::SimpleAtoi(list_name.substr(open + 1, close - open - 1), &list)) return std::nullopt;
  }
  if (list >= list_starts.size()) return std::nullopt;
  const size_t end = list + 1 < list_starts.size() ? list_starts[list + 1] : rows();
  if (index >= end - list_starts[list]) return std::nullopt;
  return lines[list_starts[list] + index];
}

std::string SentRows::line_range() const {
  if (lines.empty()) return "";
  if (lines.front() == lines.back()) return absl::StrCat(lines.front());
  return absl::StrCat(lines.front(), "-", lines.back());
}

}  // namespace locus::cli
