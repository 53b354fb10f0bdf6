#include "client/cli/command_words.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/choices.h"

namespace locus::cli {
namespace {

bool is_path(const std::string& value) {
  static constexpr absl::string_view kPaths[] = {"FILE", "OUT", "DIRECTORY", "BACKUP", "DATA_DIR"};
  return std::find(std::begin(kPaths), std::end(kPaths), value) != std::end(kPaths);
}

ValueKind kind_of(const OptionWords& option, char delimiter) {
  if (!option.choices.empty()) return delimiter == ',' ? ValueKind::kListOfChoices : ValueKind::kChoice;
  if (is_path(option.value)) return ValueKind::kFile;
  if (option.value == "SCENE") return ValueKind::kScene;
  if (option.value == "ADDRESS") return ValueKind::kAddress;
  return ValueKind::kAnything;
}

OptionWords words_of(CLI::Option& option) {
  OptionWords words;
  for (const std::string& name : option.get_snames()) words.names.push_back(absl::StrCat("-", name));
  for (const std::string& name : option.get_lnames()) words.names.push_back(absl::StrCat("--", name));
  if (option.get_positional()) {
    words.value = option.get_name(true);
  } else if (option.get_items_expected_max() > 0) {
    words.value = option.get_type_name();
  }
  words.choices = choices_of(option);
  words.kind = kind_of(words, option.get_delimiter());
  words.description = option.get_description();
  words.default_text = option.get_default_str();
  words.required = option.get_required();
  words.repeatable = option.get_items_expected_max() > 1;
  return words;
}

// Appends the options of `app` and of its option groups, which CLI11 represents as subcommands without a name.
void add_options(CLI::App& app, CommandWords& words) {
  for (CLI::Option* option : app.get_options()) {
    const bool help_of_group = app.get_name().empty() && option == app.get_help_ptr();
    if (option->get_group().empty() || help_of_group) continue;
    (option->get_positional() ? words.positionals : words.options).push_back(words_of(*option));
  }
  for (CLI::App* group : app.get_subcommands({})) {
    if (group->get_name().empty()) add_options(*group, words);
  }
}

CommandWords words_below(CLI::App& app, const std::string& path) {
  CommandWords words;
  words.path = path;
  words.description = app.get_description();
  words.footer = app.get_footer();
  add_options(app, words);
  for (CLI::App* command : app.get_subcommands({})) {
    if (command->get_name().empty() || command->get_group().empty()) continue;
    words.commands.push_back(words_below(*command, absl::StrCat(path, " ", command->get_name())));
  }
  return words;
}

}  // namespace

CommandWords words_of(CLI::App& app) { return words_below(app, app.get_name()); }

const OptionWords* find_option(const CommandWords& command, const std::string& name) {
  for (const OptionWords& option : command.options) {
    if (std::find(option.names.begin(), option.names.end(), name) != option.names.end()) return &option;
  }
  return nullptr;
}

}  // namespace locus::cli
