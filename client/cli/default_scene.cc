#include "client/cli/default_scene.h"

namespace locus::cli {
namespace {

constexpr char kSceneArgument[] = "SCENE";

// Returns whether `argument` is a global option whose value is the next argument.
bool takes_next(const CLI::App& app, const std::string& argument) {
  const CLI::Option* const option = app.get_option_no_throw(argument);
  return option != nullptr && option->get_items_expected_max() > 0;
}

const CLI::App* child_named(const CLI::App& command, const std::string& name) {
  for (const CLI::App* child : command.get_subcommands({})) {
    if (child->get_name() == name) return child;
  }
  return nullptr;
}

bool begins_with_scene(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional()) return option->get_name() == kSceneArgument;
  }
  return false;
}

}  // namespace

CLI::Option& add_scene_argument(CLI::App& command, std::string& scene) {
  return *command.add_option(kSceneArgument, scene, "The scene")->required();
}

std::optional<std::vector<std::string>> with_scene(const CLI::App& app, const std::vector<std::string>& arguments,
                                                   const std::string& scene) {
  const CLI::App* command = &app;
  for (size_t i = 0; i < arguments.size(); ++i) {
    if (takes_next(app, arguments[i])) {
      ++i;
      continue;
    }
    const CLI::App* const chosen = child_named(*command, arguments[i]);
    if (chosen == nullptr) continue;
    command = chosen;
    if (!command->get_subcommands({}).empty()) continue;
    if (!begins_with_scene(*command)) return std::nullopt;
    std::vector<std::string> longer = arguments;
    longer.insert(longer.begin() + static_cast<std::ptrdiff_t>(i) + 1, scene);
    return longer;
  }
  return std::nullopt;
}

}  // namespace locus::cli
