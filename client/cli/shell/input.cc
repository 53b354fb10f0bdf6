#include "client/cli/shell/input.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

InputKind kind_of_input(const std::string& line, const std::vector<TableEntry>& table) {
  const absl::string_view text = absl::StripAsciiWhitespace(line);
  if (text.empty()) return InputKind::kNothing;
  if (text == "exit" || text == "quit") return InputKind::kEnd;
  const size_t end = std::min(text.find_first_of(" \t"), text.size());
  const absl::string_view word = text.substr(0, end);
  const absl::string_view rest = absl::StripLeadingAsciiWhitespace(text.substr(end));
  if (word == "help" && !absl::StartsWith(rest, "=")) return InputKind::kHelp;
  if (word == "use" && !rest.empty() && !absl::StartsWith(rest, "=")) return InputKind::kUse;
  if (absl::StartsWith(word, "-") && word != "--" && !absl::StartsWith(word, "--[")) return InputKind::kCommand;
  const std::string path = absl::StrCat("locus ", word);
  const bool known =
      std::any_of(table.begin(), table.end(), [&](const TableEntry& entry) { return entry.path == path; });
  const bool is_lua = absl::StartsWith(rest, "=") || absl::StartsWith(rest, "(");
  return known && !is_lua ? InputKind::kCommand : InputKind::kLua;
}

}  // namespace locus::cli
