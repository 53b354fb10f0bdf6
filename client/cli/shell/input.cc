#include "client/cli/shell/input.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "core/base/similar_word.h"

namespace locus::cli {
namespace {

constexpr absl::string_view kProgram = "locus ";

}  // namespace

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

std::string without_program(const std::string& line, const std::vector<TableEntry>& table) {
  absl::string_view text = absl::StripLeadingAsciiWhitespace(line);
  if (!absl::ConsumePrefix(&text, kProgram)) return line;
  std::string rest(text);
  return kind_of_input(rest, table) == InputKind::kCommand ? rest : line;
}

std::string unknown_command(const std::string& line, const std::vector<TableEntry>& table) {
  const absl::string_view text = absl::StripAsciiWhitespace(line);
  const absl::string_view word = text.substr(0, std::min(text.find_first_of(" \t"), text.size()));
  const absl::string_view rest = absl::StripLeadingAsciiWhitespace(text.substr(word.size()));
  const bool may_be_words = rest.empty() || rest[0] == '-' || absl::ascii_isalnum(static_cast<unsigned char>(rest[0]));
  std::vector<std::string> commands;
  if (!may_be_words) return "";
  for (const TableEntry& entry : table) {
    absl::string_view name = entry.path;
    if (absl::ConsumePrefix(&name, kProgram) && !absl::StrContains(name, ' ')) commands.emplace_back(name);
  }
  const std::string similar = similar_word(word, commands);
  return similar.empty() ? "" : absl::StrCat("`", word, "` is no command; did you mean `", similar, "`?");
}

}  // namespace locus::cli
