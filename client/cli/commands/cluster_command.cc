// `locus cluster`: members and engine of a cluster, and moves of its scenes.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/default_scene.h"
#include "client/cli/extras/cluster/cluster_connections.h"
#include "client/cli/extras/cluster/cluster_facts.h"
#include "client/cli/extras/cluster/move_scenes.h"
#include "client/cli/extras/cluster/rebalance.h"
#include "client/cli/output.h"
#include "client/cli/progress.h"
#include "client/cli/report_stream.h"
#include "client/cli/security/private_file.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct ClusterStatusOptions {
  bool json = false;
};

struct ClusterMoveOptions {
  std::string scene;
  std::string address;  // empty = the server chooses
  bool with_memory = false;
};

struct ClusterDrainOptions {
  std::string address;
  bool with_memory = false;
};

struct RebalanceOptions {
  bool dry_run = false;
};

struct ClusterMapOptions {
  std::string file;  // empty = standard output
};

absl::Status engine_is_away(const v1::Cluster& cluster) {
  return absl::FailedPreconditionError(absl::StrCat("the engine", cluster.engine().empty() ? "" : " ", cluster.engine(),
                                                    " does not answer this member: scenes cannot be listed or moved"));
}

MemoryScenes memory_scenes(bool with_memory) { return with_memory ? MemoryScenes::kMove : MemoryScenes::kStay; }

// Returns the cluster whose engine answers, or an error.
absl::StatusOr<v1::Cluster> working_cluster(const client::Client& client) {
  ASSIGN_OR_RETURN(v1::Cluster cluster, read_cluster(client));
  if (!cluster.engine_answers()) return engine_is_away(cluster);
  return cluster;
}

absl::Status show_status(const ClusterStatusOptions& options, Context& context) {
  if (options.json) context.options().format = Format::kJson;
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(v1::Cluster cluster, read_cluster(*client));
  if (!cluster.engine_answers()) {
    context.write(report_of(cluster, nullptr));
    return engine_is_away(cluster);
  }
  ASSIGN_OR_RETURN(const std::vector<LedScene> scenes, read_led_scenes(*client));
  // The first answer has the members as they were last read, and made the server read them again.
  ASSIGN_OR_RETURN(cluster, read_cluster(*client));
  context.write(report_of(cluster, &scenes));
  return absl::OkStatus();
}

absl::Status move_leadership(const ClusterMoveOptions& options, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  RETURN_IF_ERROR(read_cluster(*client).status());
  ClusterConnections connections(context);
  ASSIGN_OR_RETURN(const v1::MoveSceneResponse moved,
                   connections.move(options.scene, options.address, memory_scenes(options.with_memory)));
  Report report;
  report.head = {{"scene", options.scene}, {"leader", moved.leader()}, {"token", moved.token()}};
  context.acknowledge(report, absl::StrCat(moved.leader(), " leads ", options.scene));
  return absl::OkStatus();
}

// Returns the addresses of the members that take scenes, without `excluded`.
std::vector<std::string> addresses_taking_scenes(const v1::Cluster& cluster, const std::string& excluded) {
  std::vector<std::string> addresses;
  for (const v1::ClusterMember& member : cluster.members())
    if (!member.draining() && member.address() != excluded) addresses.push_back(member.address());
  return addresses;
}

// Moves of one drain: the scenes that were moved, and why others were not.
struct Drained {
  uint64_t moved = 0;
  std::map<std::string, std::string> why;
};

// Moves the scenes that the member leads now. Returns how many it tried to move.
absl::StatusOr<size_t> drain_once(const ClusterDrainOptions& options, const client::Client& client,
                                  ClusterConnections& connections, ProgressWriter& progress, Drained& drained) {
  ASSIGN_OR_RETURN(const v1::Cluster cluster, working_cluster(client));
  const std::vector<std::string> targets = addresses_taking_scenes(cluster, options.address);
  if (targets.empty()) return absl::FailedPreconditionError("the cluster has no other member that takes scenes");
  ASSIGN_OR_RETURN(const std::vector<LedScene> scenes, read_led_scenes(client));
  std::vector<std::string> addresses = targets;
  addresses.push_back(options.address);
  std::vector<MemberLoad> loads =
      read_loads(connections, scenes, addresses, memory_scenes(options.with_memory), progress);
  MemberLoad source = std::move(loads.back());
  loads.pop_back();
  make_moves(connections, plan_drain(source, std::move(loads)), progress,
             [&](const PlannedMove& move, const absl::Status& outcome) {
               drained.moved += outcome.ok() ? 1 : 0;
               drained.why[move.scene] = std::string(outcome.message());
             });
  return source.scenes.size();
}

// Reports the scenes that the member still leads.
absl::Status report_drain(const std::string& address, const client::Client& client, const Drained& drained,
                          Context& context) {
  ASSIGN_OR_RETURN(const std::vector<LedScene> scenes, read_led_scenes(client));
  Report report;
  report.rows_name = "remaining";
  report.keys = {"scene", "why"};
  for (const LedScene& scene : scenes) {
    if (scene.leader != address) continue;
    const auto why = drained.why.find(scene.name);
    const bool failed = why != drained.why.end() && !why->second.empty();
    report.rows.push_back(
        {{"scene", scene.name},
         {"why", failed            ? why->second
                 : scene.in_memory ? "it is in memory only: --with-memory moves it without its objects"
                                   : "it came or was being read meanwhile"}});
  }
  report.head = {{"address", address}, {"moved", drained.moved}};
  if (report.rows.empty()) {
    context.acknowledge(report,
                        absl::StrCat("moved ", drained.moved, " scenes from ", address, ", which leads none now"));
    return absl::OkStatus();
  }
  context.write(report);
  return absl::FailedPreconditionError(absl::StrCat(address, " still leads ", report.rows.size(), " scenes"));
}

absl::Status drain_member(const ClusterDrainOptions& options, Context& context) {
  // Number of times that the scenes of the member are listed: some may fail once, or be created meanwhile.
  constexpr int kPasses = 3;
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const v1::Cluster cluster, working_cluster(*client));
  ASSIGN_OR_RETURN(const v1::ClusterMember member, find_member(cluster, options.address));
  if (member.draining())
    return absl::FailedPreconditionError(
        absl::StrCat(options.address, " drains already: it hands its scenes over by itself"));
  ClusterConnections connections(context);
  RETURN_IF_ERROR(connections.at(options.address).status());
  ProgressWriter progress = start_progress(context);
  Drained drained;
  for (int pass = 0; pass < kPasses; ++pass) {
    ASSIGN_OR_RETURN(const size_t tried, drain_once(options, *client, connections, progress, drained));
    if (tried == 0) break;
  }
  progress.hide();
  return report_drain(options.address, *client, drained, context);
}

absl::Status check_none_drains(const v1::Cluster& cluster) {
  for (const v1::ClusterMember& member : cluster.members())
    if (member.draining())
      return absl::FailedPreconditionError(absl::StrCat(
          member.address(), " drains, so its scenes are being moved: rebalance when it has left the cluster"));
  return absl::OkStatus();
}

absl::Status rebalance_scenes(const RebalanceOptions& options, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const v1::Cluster cluster, working_cluster(*client));
  RETURN_IF_ERROR(check_none_drains(cluster));
  ASSIGN_OR_RETURN(const std::vector<LedScene> scenes, read_led_scenes(*client));
  ClusterConnections connections(context);
  ProgressWriter progress = start_progress(context);
  const RebalancePlan plan = plan_rebalance(read_loads(
      connections, scenes, addresses_taking_scenes(cluster, /*excluded=*/""), MemoryScenes::kStay, progress));
  progress.hide();
  ReportStream stream(context.out(), context.format(),
                      {.rows_name = "moves",
                       .keys = {"scene", "from", "to", "load", "outcome"},
                       .no_rows = "no moves: the loads are balanced, or no scene can be moved to balance them",
                       .width_rows = 1});
  stream.begin(
      {{"mean", std::llround(plan.mean)}, {"busiest", plan.busiest_before}, {"busiest_after", plan.busiest_after}});
  uint64_t failed = 0;
  const auto add = [&](const PlannedMove& move, const std::string& outcome) {
    stream.add(
        {{"scene", move.scene}, {"from", move.from}, {"to", move.to}, {"load", move.load}, {"outcome", outcome}});
    context.out().flush();
  };
  if (options.dry_run) {
    for (const PlannedMove& move : plan.moves) add(move, "planned");
  } else {
    make_moves(connections, plan.moves, progress, [&](const PlannedMove& move, const absl::Status& outcome) {
      failed += outcome.ok() ? 0 : 1;
      add(move, outcome.ok() ? "moved" : std::string(outcome.message()));
    });
  }
  progress.hide();
  stream.end();
  if (failed == 0) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(failed, " of ", plan.moves.size(), " scenes were not moved: run the command again"));
}

absl::Status show_map(const ClusterMapOptions& options, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  RETURN_IF_ERROR(read_cluster(*client).status());
  ASSIGN_OR_RETURN(const std::vector<LedScene> scenes, read_led_scenes(*client));
  const std::string lines = map_lines(scenes);
  Report report;
  if (!options.file.empty()) {
    RETURN_IF_ERROR(replace_security_file(options.file, {lines, kPublicMode}));
    const auto written = std::count(lines.begin(), lines.end(), '\n');
    report.head = {{"file", options.file}, {"scenes", written}};
    context.acknowledge(report, absl::StrCat(options.file, ": ", written, " scenes"));
    return absl::OkStatus();
  }
  if (context.format() == Format::kTable) {
    context.out() << lines;
    return absl::OkStatus();
  }
  report.rows_name = "scenes";
  report.keys = {"scene", "leader"};
  for (const LedScene& scene : scenes)
    if (!scene.leader.empty()) report.rows.push_back({{"scene", scene.name}, {"leader", scene.leader}});
  context.write(report);
  return absl::OkStatus();
}

void add_cluster_status(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<ClusterStatusOptions>();
  CLI::App& command = *parent.add_subcommand("status", "Show the members, the engine, and who leads how many scenes");
  command.footer(
      "`load` counts 1,000 for each scene and 1 for each object of the scenes that a member leads, as it said about a\n"
      "second ago. `this` is the member that was asked. Exits 1 if the server belongs to no cluster, or if the engine\n"
      "does not answer it.\n"
      "Examples:\n  locus cluster status\n  locus cluster status --json\n  locus -a 10.0.0.7:7575 cluster status");
  command.add_flag("--json", options->json, "The same as `-o json`");
  run_when_chosen(command, options, context, show_status);
}

void add_with_memory(CLI::App& command, bool& with_memory) {
  command.add_flag("--with-memory", with_memory, "Move scenes of durability memory, too, which lose their objects");
}

void add_cluster_move(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<ClusterMoveOptions>();
  CLI::App& command = *parent.add_subcommand("move", "Move the leadership of a scene to another member");
  command.footer(
      "Updates wait for about a second at most; nothing is lost, and epoch and revisions go on. Any member may be\n"
      "asked: the command finds the leader. It needs the right `admin` to the scene. A scene of durability memory is\n"
      "not moved without --with-memory, because it begins anew, empty and in another epoch.\n"
      "Examples:\n  locus cluster move arena\n  locus cluster move arena 10.0.0.7:7575");
  add_scene_argument(command, options->scene);
  command.add_option("ADDRESS", options->address, "The new leader, as `cluster status` shows it [the less loaded]");
  add_with_memory(command, options->with_memory);
  run_when_chosen(command, options, context, move_leadership);
}

void add_cluster_drain(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<ClusterDrainOptions>();
  CLI::App& command = *parent.add_subcommand("drain", "Move every scene that a member leads to the others");
  command.footer(
      "The member stays in the cluster and takes new scenes. To stop it, SIGTERM is enough: it hands its scenes over\n"
      "by itself. Each scene goes to the member that is then the least loaded. Exits 1 and lists the scenes that\n"
      "remain, if there are any.\n"
      "Examples:\n  locus cluster drain 10.0.0.7:7575\n  locus -o json cluster drain 10.0.0.7:7575");
  command.add_option("ADDRESS", options->address, "The member, as `cluster status` shows it")->required();
  add_with_memory(command, options->with_memory);
  run_when_chosen(command, options, context, drain_member);
}

void add_cluster_rebalance(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<RebalanceOptions>();
  CLI::App& command = *parent.add_subcommand("rebalance", "Move scenes from the busiest members to the others");
  command.footer(
      "Scenes move until the busiest member has at most 1.2 times the mean load, or no move helps. The load of a "
      "scene\n"
      "is 1,000 and 1 for each object. Each move is printed when it is made. Scenes of durability memory stay. "
      "Refused\n"
      "while a member drains, because its scenes are moving then.\n"
      "Examples:\n  locus cluster rebalance --dry-run\n  locus cluster rebalance");
  command.add_flag("--dry-run", options->dry_run, "Print the moves and make none");
  run_when_chosen(command, options, context, rebalance_scenes);
}

void add_cluster_map(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<ClusterMapOptions>();
  CLI::App& command = *parent.add_subcommand("map", "Print the leader of each scene, as a map for HAProxy");
  command.footer(
      "A line `SCENE ADDRESS` for each scene that has a leader, ascending by scene. HAProxy looks up the metadata\n"
      "`x-scene` in it (deploy/cluster/haproxy.cfg), and reads the file when it starts or reloads; update_map.py "
      "there\n"
      "changes the map of a running proxy. FILE is replaced in one step, and only if the scenes could be listed.\n"
      "Examples:\n  locus cluster map\n  locus cluster map /etc/locus/scenes.map");
  command.add_option("FILE", options->file, "Replace this file instead of printing the map");
  run_when_chosen(command, options, context, show_map);
}

}  // namespace

void add_cluster_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand("cluster", "See the members of a cluster, and move scenes between them");
  command.require_subcommand(1);
  command.footer(
      "Examples:\n  locus cluster status\n  locus cluster move arena\n  locus cluster drain 10.0.0.7:7575\n"
      "  locus cluster rebalance --dry-run\n  locus cluster map /etc/locus/scenes.map");
  add_cluster_status(command, context);
  add_cluster_move(command, context);
  add_cluster_drain(command, context);
  add_cluster_rebalance(command, context);
  add_cluster_map(command, context);
}

}  // namespace locus::cli
