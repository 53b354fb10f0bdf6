#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client/cli/arguments.h"
#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/default_scene.h"
#include "client/cli/extras/cluster/cluster_facts.h"
#include "client/cli/failure.h"
#include "client/cli/output.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct CreateOptions {
  std::string name;
  std::vector<std::string> labels;
  v1::Winding winding = v1::WINDING_UNSPECIFIED;
  std::string static_from;
  uint32_t history_ticks = 0;
  uint64_t history_bytes = 0;
  v1::OverloadPolicy overload = v1::OVERLOAD_POLICY_UNSPECIFIED;
  uint32_t idle_ttl_s = 0;
  uint32_t mesh_grace_s = 0;
  double cell_size = 0;
  bool if_absent = false;
};

struct UpdateOptions {
  std::string name;
  std::optional<double> cell_size;
  std::vector<std::string> labels;
  bool no_labels = false;
};

struct ListOptions {
  std::vector<std::string> labels;
};

struct DescribeOptions {
  std::string name;
};

struct DeleteOptions {
  std::string name;
  bool if_present = false;
};

absl::StatusOr<std::map<std::string, std::string>> parse_labels(const std::vector<std::string>& texts) {
  std::map<std::string, std::string> labels;
  for (const std::string& text : texts) {
    const size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos) {
      return usage_error(absl::StrCat("label ", text, " is not of the form KEY=VALUE"));
    }
    labels[text.substr(0, equals)] = text.substr(equals + 1);
  }
  return labels;
}

std::string state_name(v1::SceneState state) {
  return absl::AsciiStrToLower(absl::StripPrefix(v1::SceneState_Name(state), "SCENE_STATE_"));
}

Json scene_summary(const v1::Scene& scene) {
  return {{"name", scene.name()},
          {"state", state_name(scene.state())},
          {"revision", scene.revision()},
          {"tick", scene.tick()},
          {"objects", scene.objects()},
          {"instances", scene.instances()},
          {"triangles", scene.triangles()},
          {"memory_bytes", scene.memory_bytes()},
          {"mesh_bytes", scene.mesh_bytes()},
          {"past_bytes", scene.history_bytes() + scene.recent_bytes()}};
}

// Returns whether the server has the scene. In a cluster, it describes other scenes by their name and leader only.
bool has_figures(const v1::Scene& scene) {
  const v1::ScenePlacement& placement = scene.placement();
  return !scene.has_placement() || placement.role() == v1::SCENE_ROLE_LEADING ||
         placement.role() == v1::SCENE_ROLE_FOLLOWING ||
         (placement.role() == v1::SCENE_ROLE_NO_LEADER && !placement.leader().empty());
}

// Adds the leader of a scene, if the server belongs to a cluster, and removes figures that the server does not know.
void add_leader(const v1::Scene& scene, Json& json) {
  if (!scene.has_placement()) return;
  if (!has_figures(scene)) {
    for (auto& [key, value] : json.items())
      if (key != "name" && key != "state") value = nullptr;
  }
  const v1::ScenePlacement& placement = scene.placement();
  json["role"] = role_name(placement.role());
  json["leader"] = placement.leader().empty() ? Json() : Json(placement.leader());
}

// Returns the reason why the history does not reach further back, such as "bytes".
std::string limit_name(v1::HistoryLimit limit) {
  return absl::AsciiStrToLower(absl::StripPrefix(v1::HistoryLimit_Name(limit), "HISTORY_LIMIT_"));
}

// Returns labels in ascending order.
template <class Labels>
Json labels_json(const Labels& labels) {
  Json json = Json::object();
  const std::map<std::string, std::string> sorted(labels.begin(), labels.end());
  for (const auto& [key, value] : sorted) json[key] = value;
  return json;
}

Json corner_of(bool present, const v1::Vec3d& corner) {
  return present ? doubles_json({corner.x(), corner.y(), corner.z()}) : Json();
}

Report description_of(const v1::Scene& scene) {
  Report report;
  report.head = scene_summary(scene);
  add_leader(scene, report.head);
  if (scene.has_placement()) report.head["token"] = scene.placement().token();
  report.head["epoch"] = id_json(scene.epoch());
  report.head["min"] = corner_of(scene.has_min(), scene.min());
  report.head["max"] = corner_of(scene.has_max(), scene.max());
  report.head["winding"] = scene.spec().winding() == v1::WINDING_CLOCKWISE ? "clockwise" : "counter-clockwise";
  if (scene.spec().history_ticks() != 0) {
    report.head["history"] = {
        {"ticks", scene.spec().history_ticks()},     {"bytes", scene.spec().history_bytes()},
        {"oldest_tick", scene.oldest_tick()},        {"recorded_ticks", scene.recorded_ticks()},
        {"used_bytes", scene.history_bytes()},       {"limited_by", limit_name(scene.history_limit())},
        {"forgotten_ticks", scene.forgotten_ticks()}};
  }
  if (scene.spec().overload() == v1::OVERLOAD_POLICY_LATEST_WINS) {
    report.head["overload"] = "latest-wins";
    report.head["joined_updates"] = scene.joined_updates();
  }
  if (scene.spec().idle_ttl_s() != 0) report.head["idle_ttl_s"] = scene.spec().idle_ttl_s();
  if (scene.spec().mesh_grace_s() != 0) report.head["mesh_grace_s"] = scene.spec().mesh_grace_s();
  report.head["recent_bytes"] = scene.recent_bytes();
  report.head["pinned_bytes"] = scene.pinned_bytes();
  report.head["pending_changes"] = scene.pending_changes();
  if (!scene.last_build_error().empty()) report.head["last_build_error"] = scene.last_build_error();
  if (scene.spec().cell_size() != 0) report.head["cell_size"] = scene.spec().cell_size();
  if (!scene.spec().labels().empty()) report.head["labels"] = labels_json(scene.spec().labels());
  return report;
}

// Adds the structures and the learned costs. Servers of earlier versions send none.
void add_structures(const v1::SceneDescription& description, Report& report) {
  const v1::Structure &statics = description.statics(), &objects = description.objects();
  report.head["static_structure"] = {{"kind", "bvh"},
                                     {"values", statics.values()},
                                     {"levels", statics.levels()},
                                     {"nodes", statics.nodes()},
                                     {"bytes", statics.bytes()}};
  report.head["object_structure"] = {
      {"kind", "hash_grid"},        {"values", objects.values()},       {"levels", objects.levels()},
      {"bricks", objects.bricks()}, {"cell_size", objects.cell_size()}, {"bytes", objects.bytes()}};
  report.head["costs"] = Json::array();
  for (const v1::LearnedCost& cost : description.costs())
    report.head["costs"].push_back(
        {{"kind", cost.kind()},
         {"source", absl::AsciiStrToLower(absl::StripPrefix(v1::Source_Name(cost.source()), "SOURCE_"))},
         {"by_list", cost.by_list()},
         {"ns", std::round(cost.nanoseconds() * 10) / 10},
         {"work", std::round(cost.work() * 10) / 10}});
}

absl::Status create(const CreateOptions& options, Context& context) {
  ASSIGN_OR_RETURN(const auto labels, parse_labels(options.labels));
  v1::CreateSceneRequest request;
  request.set_name(options.name);
  request.set_if_absent(options.if_absent);
  request.mutable_spec()->set_winding(options.winding);
  request.mutable_spec()->set_static_from(options.static_from);
  request.mutable_spec()->set_history_ticks(options.history_ticks);
  request.mutable_spec()->set_history_bytes(options.history_bytes);
  request.mutable_spec()->set_overload(options.overload);
  request.mutable_spec()->set_idle_ttl_s(options.idle_ttl_s);
  request.mutable_spec()->set_mesh_grace_s(options.mesh_grace_s);
  request.mutable_spec()->set_cell_size(options.cell_size);
  request.mutable_spec()->mutable_labels()->insert(labels.begin(), labels.end());
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const v1::Scene scene, client->create_scene(request));
  context.remember_own(options.name, {scene.epoch(), scene.revision()});
  context.write(description_of(scene));
  return absl::OkStatus();
}

absl::Status list_scenes(const ListOptions& options, Context& context) {
  ASSIGN_OR_RETURN(const auto labels, parse_labels(options.labels));
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const std::vector<v1::Scene> scenes, client->list_scenes(labels));
  Report report;
  report.rows_name = "scenes";
  report.no_rows = "no scenes";
  const Json columns = scene_summary({});
  for (const auto& [key, value] : columns.items()) report.keys.push_back(key);
  const bool in_cluster =
      std::any_of(scenes.begin(), scenes.end(), [](const v1::Scene& scene) { return scene.has_placement(); });
  if (in_cluster) report.keys.insert(report.keys.end(), {"role", "leader"});
  for (const v1::Scene& scene : scenes) {
    report.rows.push_back(scene_summary(scene));
    add_leader(scene, report.rows.back());
  }
  context.write(report);
  return absl::OkStatus();
}

absl::Status describe_scene(const DescribeOptions& options, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const v1::GetSceneResponse got, client->describe_scene(options.name));
  Report report = description_of(got.scene());
  if (got.has_description()) add_structures(got.description(), report);
  context.write(report);
  return absl::OkStatus();
}

absl::Status update_scene(const UpdateOptions& options, Context& context) {
  if (options.no_labels && !options.labels.empty()) return usage_error("give --label or --no-labels, not both");
  ASSIGN_OR_RETURN(const auto labels, parse_labels(options.labels));
  v1::UpdateSceneRequest request;
  request.set_name(options.name);
  if (options.cell_size) {
    request.add_fields("cell_size");
    request.set_cell_size(*options.cell_size);
  }
  if (options.no_labels || !labels.empty()) {
    request.add_fields("labels");
    request.mutable_labels()->insert(labels.begin(), labels.end());
  }
  if (request.fields().empty()) return usage_error("give --cell-size, --label or --no-labels");
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const v1::UpdateSceneResponse updated, client->update_scene(request));
  Report report;
  report.head["updated"] = options.name;
  report.head["cell_size"] = updated.cell_size();
  report.head["labels"] = labels_json(updated.labels());
  context.acknowledge(report, absl::StrCat("updated ", options.name));
  return absl::OkStatus();
}

absl::Status delete_scene(const DeleteOptions& options, Context& context) {
  v1::DeleteSceneRequest request;
  request.set_name(options.name);
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  const absl::Status deleted = client->delete_scene(request);
  const bool absent = absl::IsNotFound(deleted) && options.if_present;
  if (!absent) RETURN_IF_ERROR(deleted);
  context.forget_own(options.name);
  Report report;
  report.head[absent ? "absent" : "deleted"] = options.name;
  context.acknowledge(report, absl::StrCat(absent ? "absent " : "deleted ", options.name));
  return absl::OkStatus();
}

void add_create(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<CreateOptions>();
  CLI::App& command = *parent.add_subcommand("create", "Create an empty scene");
  command.footer(R"(Examples:
  locus scene create arena
  locus scene create arena --if-absent --label map=delta --label mode=ctf
  locus scene create arena --history-ticks 64 --overload latest-wins
  locus scene create match-17 --idle-ttl-s 600 --mesh-grace-s 60
  locus scene create swarm --cell-size 2
  locus scene create arena-copy --static-from arena)");
  command.add_option("NAME", options->name, "Lower case letters, digits, - _ and ., at most 63")->required();
  command.add_flag("--if-absent", options->if_absent, "Accept a scene of that name as it is");
  add_repeatable(command, "--label", options->labels, "KEY=VALUE", "Your own label, by which `scene list` can filter");
  const NamedValues<v1::Winding> windings = {{"ccw", v1::WINDING_COUNTER_CLOCKWISE}, {"cw", v1::WINDING_CLOCKWISE}};
  command.add_option("--winding", options->winding, "Order of vertices seen from a triangle's front: ccw, cw [ccw]")
      ->type_name("ORDER")
      ->transform(choices(windings));
  command.add_option("--static-from", options->static_from, "Start with the instances of this scene")
      ->type_name("SCENE");
  command.add_option("--history-ticks", options->history_ticks, "Number of past ticks that can be queried [0]")
      ->type_name("TICKS");
  command.add_option("--history-bytes", options->history_bytes, "Maximum memory of the history [256 MiB]")
      ->type_name("BYTES");
  const NamedValues<v1::OverloadPolicy> policies = {{"every-batch", v1::OVERLOAD_POLICY_EVERY_BATCH},
                                                    {"latest-wins", v1::OVERLOAD_POLICY_LATEST_WINS}};
  command
      .add_option("--overload", options->overload,
                  "Batches that arrive too fast: one revision each (every-batch) or joined (latest-wins) [every-batch]")
      ->type_name("POLICY")
      ->transform(choices(policies));
  command
      .add_option("--idle-ttl-s", options->idle_ttl_s, "Delete the scene after so many seconds without use [0: never]")
      ->type_name("SECONDS");
  command
      .add_option("--mesh-grace-s", options->mesh_grace_s,
                  "Delete a mesh of the scene so many seconds after its last use in any scene [0: never]")
      ->type_name("SECONDS");
  command
      .add_option("--cell-size", options->cell_size,
                  "Edge of the cells of the objects' grid, rounded up to a power of two [0: the server chooses]")
      ->type_name("SIZE");
  run_when_chosen(command, options, context, create);
}

void add_update(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<UpdateOptions>();
  CLI::App& command = *parent.add_subcommand("update", "Change the cell size or the labels of a scene");
  command.footer(R"(Examples:
  locus scene update arena --cell-size 4
  locus scene update arena --cell-size 0
  locus scene update arena --label map=delta --label mode=ctf

No answer changes, so there is no new revision. After a change of the cell size, each batch of updates refiles a few
thousand objects. The given labels replace all labels.)");
  add_scene_argument(command, options->name);
  command
      .add_option("--cell-size", options->cell_size,
                  "Edge of the cells of the objects' grid, rounded up to a power of two; 0: the server chooses")
      ->type_name("SIZE");
  add_repeatable(command, "--label", options->labels, "KEY=VALUE", "A label; all others are removed");
  command.add_flag("--no-labels", options->no_labels, "Remove all labels");
  run_or_check_when_chosen(command, options, context, update_scene);
}

void add_list(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<ListOptions>();
  CLI::App& command = *parent.add_subcommand("list", "List the scenes of the server");
  command.footer(
      "memory_bytes is the memory of the objects and instances, mesh_bytes that of the placed meshes, which scenes\n"
      "share, and past_bytes at most that of the history and of recent revisions. A server of a cluster lists the\n"
      "scenes of all members: role is its own (leading, elsewhere, no_leader), leader the address of the leader. Of\n"
      "scenes that it does not have it knows no figures.\n"
      "Examples:\n  locus scene list\n  locus -o ndjson scene list --label mode=ctf");
  add_repeatable(command, "--label", options->labels, "KEY=VALUE", "Only scenes with this label");
  run_when_chosen(command, options, context, list_scenes);
}

void add_describe(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<DescribeOptions>();
  CLI::App& command = *parent.add_subcommand("describe", "Show everything about a scene");
  command.alias("get");
  command.footer(
      "Of the history, limited_by says why it does not reach further back: ticks (as asked for), bytes (more ticks\n"
      "did not fit into --history-bytes), memory (the server was short of it), began or restored.\n"
      "In a cluster, token is the number of the leadership: each new leader has a higher one.\n"
      "costs are those of queries, by kind: nanoseconds and work (nodes, cells and tests) of one query.\n"
      "Examples:\n  locus scene get arena\n  locus -o json scene get arena\n  locus scene describe arena");
  add_scene_argument(command, options->name);
  run_when_chosen(command, options, context, describe_scene);
}

void add_delete(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<DeleteOptions>();
  CLI::App& command = *parent.add_subcommand("delete", "Delete a scene with its objects and instances; meshes stay");
  command.footer("Examples:\n  locus scene delete arena\n  locus scene delete arena --if-present");
  command.add_option("NAME", options->name, "The scene")->required();
  command.add_flag("--if-present", options->if_present, "Succeed if no scene has the name");
  run_when_chosen(command, options, context, delete_scene);
}

}  // namespace

void add_scene_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand("scene", "Create, list, describe, change and delete scenes");
  command.footer("Examples:\n  locus scene create arena\n  locus scene list\n  locus scene delete arena");
  command.require_subcommand(1);
  add_create(command, context);
  add_list(command, context);
  add_describe(command, context);
  add_update(command, context);
  add_delete(command, context);
}

}  // namespace locus::cli
