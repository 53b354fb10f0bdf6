#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/commands/dump_command.h"
#include "client/cli/default_scene.h"
#include "client/cli/failure.h"
#include "client/cli/rows/update_report.h"
#include "client/lib/client.h"
#include "client/lib/status.h"
#include "client/lib/update_builder.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct PlaceOptions {
  std::string scene;
  std::string mesh;
  std::vector<Triple> at;
  std::vector<Quaternion> rotations;
  std::vector<double> scales;
  std::vector<Number64> ids;
  std::vector<Number64> layers;
  std::vector<Number64> groups;
  std::vector<Number64> tags;
};

struct ListOptions {
  std::string scene;
  ViewOptions view;
};

struct RemoveOptions {
  std::string scene;
  std::vector<Number64> ids;
  std::vector<Number64> groups;
};

struct InstanceMoveOptions {
  std::string scene;
  std::vector<Number64> ids;
  std::vector<Triple> to;
  std::vector<Quaternion> rotations;
  std::vector<double> scales;
  std::optional<uint64_t> tick;
  bool teleport = false;
};

struct InstanceRelabelOptions {
  std::string scene;
  std::vector<Number64> ids;
  std::optional<Number64> layers, group, tag;
  std::optional<uint64_t> tick;
};

template <class Values, class Column>
void add_values(const Values& values, Column& column) {
  column.Add(values.begin(), values.end());
}

// Returns `status` with the code NOT_FOUND if it refuses an unknown id, as `locus remove` does for objects.
absl::Status unknown_id_as_not_found(const absl::Status& status) {
  const std::optional<v1::Error> error = client::error_of(status);
  if (!error || error->reason() != v1::REASON_UNKNOWN_ID) return status;
  absl::Status not_found = absl::NotFoundError(status.message());
  status.ForEachPayload(
      [&](absl::string_view type, const absl::Cord& payload) { not_found.SetPayload(type, payload); });
  return not_found;
}

absl::Status place(const PlaceOptions& options, Context& context) {
  if (!options.ids.empty() && options.ids.size() != options.at.size() && options.at.size() != 1)
    return usage_error("give one --id for each --at, or none");
  v1::ChangeInstancesRequest request;
  request.set_scene(options.scene);
  v1::Placement& placement = *request.add_place();
  placement.set_mesh(options.mesh);
  add_values(doubles_of(options.at), *placement.mutable_translations());
  add_values(floats_of(options.rotations), *placement.mutable_rotations());
  add_values(floats_of(options.scales), *placement.mutable_scales());
  add_values(values_of(options.ids), *placement.mutable_ids());
  add_values(values32_of(options.layers), *placement.mutable_layers());
  add_values(values_of(options.groups), *placement.mutable_groups());
  add_values(values_of(options.tags), *placement.mutable_tags());
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const v1::ChangeInstancesResponse placed, client->change_instances(request));
  context.remember_own(options.scene, {placed.epoch(), placed.revision()});
  Report report;
  report.head = {{"scene", options.scene}, {"mesh", options.mesh}, {"revision", placed.revision()}};
  report.rows_name = "instances";
  report.keys = {"id"};
  for (const uint64_t id : placed.ids()) report.rows.push_back({{"id", id_json(id)}});
  context.write(report);
  return absl::OkStatus();
}

absl::Status list_instances(const ListOptions& options, Context& context) {
  ViewOptions view = options.view;
  view.instances = true;
  return dump_things(options.scene, view, {.rows_name = "instances", .no_rows = "no instances"}, context);
}

absl::Status remove_instances(const RemoveOptions& options, Context& context) {
  if (options.ids.empty() && options.groups.empty()) return usage_error("nothing to remove: give --id or --group");
  v1::ChangeInstancesRequest request;
  request.set_scene(options.scene);
  add_values(values_of(options.ids), *request.mutable_remove_ids());
  add_values(values_of(options.groups), *request.mutable_remove_groups());
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  const absl::StatusOr<v1::ChangeInstancesResponse> removed = client->change_instances(request);
  if (!removed.ok()) return unknown_id_as_not_found(removed.status());
  context.remember_own(options.scene, {removed->epoch(), removed->revision()});
  Report report;
  report.head = {{"scene", options.scene}, {"revision", removed->revision()}};
  context.acknowledge(report, absl::StrCat("scene ", options.scene, ", revision ", removed->revision()));
  return absl::OkStatus();
}

absl::Status move_instances(const InstanceMoveOptions& options, Context& context) {
  const std::vector<uint64_t> ids = values_of(options.ids);
  const std::vector<double> positions = doubles_of(options.to);
  const std::vector<float> rotations = floats_of(options.rotations), scales = floats_of(options.scales);
  client::UpdateBuilder builder;
  if (options.tick) builder.tick(*options.tick);
  builder.move_instances({.ids = ids, .positions_f64 = positions, .rotations = rotations, .scales = scales},
                         options.teleport ? client::MoveKind::kTeleport : client::MoveKind::kContinuous);
  return apply_and_report(options.scene, builder.build(), context);
}

absl::Status relabel_instances(const InstanceRelabelOptions& options, Context& context) {
  if (!options.layers && !options.group && !options.tag) return usage_error("give --layers, --group or --tag");
  client::Relabeling labels;
  if (options.layers) labels.layers = static_cast<uint32_t>(options.layers->value);
  if (options.group) labels.group = options.group->value;
  if (options.tag) labels.tag = options.tag->value;
  client::UpdateBuilder builder;
  if (options.tick) builder.tick(*options.tick);
  for (const uint64_t id : values_of(options.ids)) builder.relabel_instance(id, labels);
  return apply_and_report(options.scene, builder.build(), context);
}

void add_place(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<PlaceOptions>();
  CLI::App& command = *parent.add_subcommand("place", "Place an uploaded mesh, once or more, as one change");
  command.footer(R"(Examples:
  locus instance place arena --mesh city-5000-1 --at 0,0,0
  locus instance place arena --mesh door --id 7 --at 10,0,0 --rotation 0,0,0.7071068,0.7071068
  locus instance place arena --mesh tree --at 1,0,0 --at 5,2,0 --scale 1.5

Except --id, an option given once stands for all instances.)");
  add_scene_argument(command, options->scene);
  command.add_option("--mesh", options->mesh, "The mesh's name on the server")->required()->type_name("NAME");
  add_repeatable(command, "--at", options->at, "X,Y,Z", "Where its origin goes; repeat for more instances")->required();
  add_repeatable(command, "--rotation", options->rotations, "X,Y,Z,W", "Unit quaternion [0,0,0,1]");
  add_repeatable(command, "--scale", options->scales, "S", "Its size, as a multiple of the mesh's [1]");
  add_repeatable(command, "--id", options->ids, "ID", "The instance's id [chosen by the server]");
  add_repeatable(command, "--layers", options->layers, "BITS", "Layer bits, matched with the masks of queries [1]")
      ->check(fits_32_bits());
  add_repeatable(command, "--group", options->groups, "GROUP", "Its group [0: none]");
  add_repeatable(command, "--tag", options->tags, "TAG", "Any number of your own [0]");
  run_when_chosen(command, options, context, place);
}

void add_list(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<ListOptions>();
  CLI::App& command = *parent.add_subcommand("list", "List the instances of a scene, by id");
  command.footer("Examples:\n  locus instance list arena\n  locus -o ndjson instance list arena --at-least 12");
  add_scene_argument(command, options->scene);
  add_revision_options(command, options->view);
  run_when_chosen(command, options, context, list_instances);
}

void add_instance_move(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<InstanceMoveOptions>();
  CLI::App& command = *parent.add_subcommand("move", "Move instances, such as doors, as one update");
  command.footer(R"(Examples:
  locus instance move arena --id 7 --to 10,0,0 --rotation 0,0,0,1
  locus instance move arena --id 7 --to 1,2,4 --id 8 --to 0,0,1 --tick 120

Except --id, an option given once stands for all instances.)");
  add_scene_argument(command, options->scene);
  add_repeatable(command, "--id", options->ids, "ID", "An instance; repeat --id and --to for more")->required();
  add_repeatable(command, "--to", options->to, "X,Y,Z", "Where its origin goes")->required();
  add_repeatable(command, "--rotation", options->rotations, "X,Y,Z,W", "Its new rotation [kept]");
  add_repeatable(command, "--scale", options->scales, "S", "Its new size, as a multiple of the mesh's [kept]");
  command.add_option("--tick", options->tick, "The time step [the scene's]")->type_name("TICK");
  command.add_flag("--teleport", options->teleport, "It jumped: queries about the past do not interpolate this move");
  run_or_check_when_chosen(command, options, context, move_instances);
}

void add_instance_relabel(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<InstanceRelabelOptions>();
  CLI::App& command = *parent.add_subcommand("relabel", "Hide and show instances, or set their group and tag");
  command.footer(R"(Examples:
  locus instance relabel arena --id 7 --layers 0
  locus instance relabel arena --id 7 --id 8 --layers 1 --tag 5

Layers 0 hide an instance from every query but lookups; other layers show it again.)");
  add_scene_argument(command, options->scene);
  add_repeatable(command, "--id", options->ids, "ID", "An instance; repeat for more")->required();
  command.add_option("--layers", options->layers, "Layer bits; 0 hides it [kept]")
      ->type_name("BITS")
      ->check(fits_32_bits());
  command.add_option("--group", options->group, "Its group, 0: none [kept]")->type_name("GROUP");
  command.add_option("--tag", options->tag, "Any number of your own [kept]")->type_name("TAG");
  command.add_option("--tick", options->tick, "The time step [the scene's]")->type_name("TICK");
  run_or_check_when_chosen(command, options, context, relabel_instances);
}

void add_remove(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<RemoveOptions>();
  CLI::App& command = *parent.add_subcommand("remove", "Remove instances as one change; their meshes stay");
  command.footer(R"(Examples:
  locus instance remove arena --id 7
  locus instance remove arena --id 7 --id 8
  locus instance remove arena --group 3)");
  add_scene_argument(command, options->scene);
  add_repeatable(command, "--id", options->ids, "ID", "An instance");
  add_repeatable(command, "--group", options->groups, "GROUP", "All instances of a group");
  run_or_check_when_chosen(command, options, context, remove_instances);
}

}  // namespace

void add_instance_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand("instance", "Place, list, move and remove instances of meshes");
  command.footer(R"(Examples:
  locus instance place arena --mesh city-5000-1 --at 0,0,0
  locus instance list arena
  locus instance move arena --id 7 --to 10,0,0
  locus instance remove arena --id 7)");
  command.require_subcommand(1);
  add_place(command, context);
  add_list(command, context);
  add_instance_move(command, context);
  add_instance_relabel(command, context);
  add_remove(command, context);
}

}  // namespace locus::cli
