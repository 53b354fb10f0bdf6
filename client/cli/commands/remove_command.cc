#include <memory>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/commands/bulk_update.h"
#include "client/cli/default_scene.h"
#include "client/cli/failure.h"
#include "client/cli/rows/update_report.h"
#include "client/lib/update_builder.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct RemoveOptions {
  std::string scene;
  BulkOptions bulk;
  std::vector<Number64> ids;
  std::vector<Number64> groups;
  bool all = false;
};

absl::Status remove_rows(const RemoveOptions& options, Context& context) {
  RETURN_IF_ERROR(check(options.bulk));
  if (!options.ids.empty() || !options.groups.empty() || options.all) {
    return usage_error("give --id, --group or --all, or an input of ids, not both");
  }
  const BulkUpdate update = {.schema = {{.name = "id", .kind = FieldKind::kId, .required = true}},
                             .check_row = {},
                             .batch_of = [](const RowBatch& batch) {
                               client::UpdateBuilder builder;
                               builder.remove(batch.columns[0].integers);
                               return builder.build();
                             }};
  return run_bulk_update(update, options.scene, options.bulk, context);
}

absl::Status remove(const RemoveOptions& options, Context& context) {
  if (options.bulk.given()) return remove_rows(options, context);
  RETURN_IF_ERROR(check(options.bulk));
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
  locus remove arena --all
  locus remove arena --from-csv ids.csv

Rows: a column id, or {"id": "7"} a line. Each batch is one revision.)");
  add_scene_argument(command, options->scene);
  add_repeatable(command, "--id", options->ids, "ID", "An object");
  add_repeatable(command, "--group", options->groups, "GROUP", "All objects of a group");
  command.add_flag("--all", options->all, "Every object");
  add_bulk_update_options(command, options->bulk);
  run_or_check_when_chosen(command, options, context, remove);
}

}  // namespace locus::cli
