#include "client/cli/extras/completion/table.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"

namespace locus::cli {
namespace {

// Returns the description with line breaks and tabs replaced by spaces, since line breaks separate the lines of the
// table and tabs separate their fields.
std::string short_text(const std::string& description) {
  return absl::StrReplaceAll(description, {{"\n", " "}, {"\t", " "}});
}

std::string value_field(const OptionWords& option) {
  if (option.value.empty()) return "-";
  switch (option.kind) {
    case ValueKind::kAnything:
      return "any";
    case ValueKind::kChoice:
      return absl::StrCat("choice ", absl::StrJoin(option.choices, " "));
    case ValueKind::kListOfChoices:
      return absl::StrCat("list ", absl::StrJoin(option.choices, " "));
    case ValueKind::kFile:
      return "file";
    case ValueKind::kScene:
      return "scene";
    case ValueKind::kAddress:
      return "address";
  }
  return "any";
}

std::string line(const std::string& kind, const std::string& word, const std::string& value, const std::string& text) {
  return absl::StrCat(kind, "\t", word, "\t", value, "\t", short_text(text));
}

// Appends a line for each name of each option to `lines`.
void add_option_lines(const std::vector<OptionWords>& options, std::vector<std::string>& lines) {
  for (const OptionWords& option : options) {
    for (const std::string& name : option.names) {
      lines.push_back(line("option", name, value_field(option), option.description));
    }
  }
}

// Returns the options that `command` accepts: the command's own options, followed by the options of the commands above
// it. An option that the command redefines under the same name appears only once.
std::vector<OptionWords> options_in_reach(const CommandWords& command, const std::vector<OptionWords>& above) {
  std::vector<OptionWords> options = command.options;
  for (const OptionWords& option : above) {
    if (find_option(command, option.names.back()) == nullptr) options.push_back(option);
  }
  return options;
}

// Appends the table entries of `command` and of all commands below it. The depth of the recursion is bounded by the
// depth of the program's commands.
void add_entries(const CommandWords& command, const std::vector<OptionWords>& above, std::vector<TableEntry>& table) {
  TableEntry entry{command.path, {}};
  for (const CommandWords& below : command.commands) {
    entry.lines.push_back(line("command", below.path.substr(command.path.size() + 1), "-", below.description));
  }
  for (const OptionWords& positional : command.positionals) {
    entry.lines.push_back(line("positional", positional.value, value_field(positional), positional.description));
  }
  const std::vector<OptionWords> options = options_in_reach(command, above);
  add_option_lines(options, entry.lines);
  table.push_back(std::move(entry));
  for (const CommandWords& below : command.commands) add_entries(below, options, table);
}

}  // namespace

std::vector<TableEntry> completion_table(const CommandWords& program) {
  std::vector<TableEntry> table;
  add_entries(program, {}, table);
  return table;
}

}  // namespace locus::cli
