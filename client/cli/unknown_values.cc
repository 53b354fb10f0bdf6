#include "client/cli/unknown_values.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "client/cli/choices.h"

namespace locus::cli {
namespace {

// Returns a value that `option` accepts. If the option accepts only certain words, the value is the first of them; if
// its type name in the help is X,Y,Z or X,Y,Z,W, the value is a vector; otherwise it is a number.
std::string suitable_value(CLI::Option& option) {
  const std::vector<std::string> words = choices_of(option);
  if (!words.empty()) return words.front();
  if (option.get_type_name() == "X,Y,Z") return "0,0,1";
  if (option.get_type_name() == "X,Y,Z,W") return "0,0,0,1";
  return "1";
}

}  // namespace

bool has_unknown(const std::vector<std::string>& arguments) {
  return std::any_of(arguments.begin(), arguments.end(),
                     [](const std::string& argument) { return absl::StrContains(argument, kNotKnownYet); });
}

void accept_unknown_values(CLI::App& app) {
  std::vector<CLI::App*> commands = {&app};
  while (!commands.empty()) {
    CLI::App& command = *commands.back();
    commands.pop_back();
    for (CLI::App* child : command.get_subcommands({})) commands.push_back(child);
    for (CLI::Option* option : command.get_options()) {
      if (option->get_items_expected_max() == 0) continue;  // a flag
      const std::string value = suitable_value(*option);
      option->transform(
          [value](const std::string& text) { return absl::StrContains(text, kNotKnownYet) ? value : text; },
          /*transform_description=*/"");
    }
  }
}

}  // namespace locus::cli
