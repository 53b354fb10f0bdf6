#include <memory>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/default_scene.h"
#include "client/cli/failure.h"
#include "client/cli/update_report.h"
#include "client/lib/update_builder.h"

namespace locus::cli {
namespace {

struct RemoveOptions {
  std::string scene;
  std::vector<Number64> ids;
  std::vector<Number64> groups;
  bool all = false;
};

absl::Status remove(const RemoveOptions& options, Context& context) {
  if (options.ids.empty() && options.groups.empty() && !options.all) {
    return usage_error("nothing to remove: give --id, --group or --all");
  }
  client::UpdateBuilder builder;
  if (options.all) builder.clear();
  builder.remove(values_of(options.ids));
  for (const Number64& group : options.groups) builder.remove_group(group.value);
  return apply_and_report(options.scene, builder.build(), context);
}

}  // namespace

void add_remove_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<RemoveOptions>();
  CLI::App& command = *parent.add_subcommand("remove", "Remove objects; instances stay");
  command.footer(R"(Examples:
  locus remove arena --id 7
  locus remove arena --id 7 --id 8
  locus remove arena --group 3
  locus remove arena --all)");
  add_scene_argument(command, options->scene);
  add_repeatable(command, "--id", options->ids, "ID", "An object");
  add_repeatable(command, "--group", options->groups, "GROUP", "All objects of a group");
  command.add_flag("--all", options->all, "Every object");
  run_when_chosen(command, options, context, remove);
}

}  // namespace locus::cli
