#include "server/services/server_service.h"

#include <algorithm>
#include <string>
#include <vector>

#include "core/base/instruction_set.h"
#include "core/base/limits.h"
#include "locus/v1/server_service.pb.h"
#include "server/config/observability_limits.h"
#include "server/config/version.h"
#include "server/host/memory_lines.h"
#include "server/rpc/call.h"
#include "server/rpc/wire_plan.h"
#include "server/scheduling/allocator_use.h"
#include "server/services/backup.h"
#include "server/services/cluster/cluster_scenes.h"
#include "server/services/cluster_calls.h"
#include "server/services/connections.h"
#include "server/services/quota_report.h"

namespace locus::server {
namespace {

bool serves(const Host& host, absl::string_view feature) {
  if (feature == kBackupFeature) return can_back_up(host);
  if (feature == "durability_replicated") return host.cluster != nullptr;
  if (feature == "mesh_grace") return host.cluster == nullptr;
  return feature != "durability_local" || (host.log != nullptr && host.cluster == nullptr);
}

struct NamedLimit {
  std::string name;
  double value;
  double used = 0;
  uint64_t refused = 0;
};

// Adds the two limits of a queue to `all`: the maximum number of jobs that wait or run, and the maximum sum of their
// estimated work in milliseconds. `limit.nanoseconds` is the maximum for each thread, so it is multiplied by `threads`.
void add_queue(const char* jobs_name, const char* work_name, const QueueLimit& limit, uint32_t threads, uint64_t jobs,
               uint64_t nanoseconds, std::vector<NamedLimit>& all) {
  constexpr double kNanosecondsAMs = 1e6;
  all.push_back({jobs_name, static_cast<double>(limit.jobs), static_cast<double>(jobs)});
  all.push_back({work_name, static_cast<double>(limit.nanoseconds) * threads / kNanosecondsAMs,
                 static_cast<double>(nanoseconds) / kNanosecondsAMs});
}

void add_queues(const Host& host, std::vector<NamedLimit>& all) {
  const SchedulerOptions& options = host.scheduler.options();
  const SchedulerStats now = host.scheduler.stats();
  const uint32_t threads = options.threads;
  add_queue("small_batches", "small_batch_work_ms", options.limits[0], threads, now.jobs[0], now.nanoseconds[0], all);
  add_queue("large_batches", "large_batch_work_ms", options.limits[1], threads, now.jobs[1], now.nanoseconds[1], all);
  add_queue("batches", "batch_work_ms", options.limit, threads, now.jobs[0] + now.jobs[1],
            now.nanoseconds[0] + now.nanoseconds[1], all);
  // The limits apply to each scene separately; the used values are the sums over all scenes.
  const UpdateQueueStats updates = host.updates.stats();
  all.push_back({"waiting_updates", static_cast<double>(host.updates.options().max_updates),
                 static_cast<double>(updates.updates)});
  all.push_back({"waiting_update_items", static_cast<double>(host.updates.options().max_items),
                 static_cast<double>(updates.items)});
}

void add_memory_lines(const Host& host, std::vector<NamedLimit>& all) {
  for (const MemoryLineUse& line : memory_lines(host.memory, host.registry, host.log))
    all.push_back({"memory_" + line.name, static_cast<double>(line.ceiling), static_cast<double>(line.used)});
  const AllocatorUse allocator = allocator_use(host.memory.used());
  all.push_back({"memory_live", static_cast<double>(host.memory.limit()), static_cast<double>(allocator.live)});
}

void add_connections(const Host& host, std::vector<NamedLimit>& all) {
  for (const ConnectionLimit& limit : connection_limits(host.config, host.connections))
    all.push_back({limit.name, limit.value, limit.used, limit.refused});
}

// Adds the numbers of refused calls and messages to the limits that refused them.
void add_refusals(const Host& host, std::vector<NamedLimit>& all) {
  for (const auto& [name, count] : host.metrics.read().refusals)
    for (NamedLimit& limit : all)
      if (limit.name == name.second) limit.refused += count;
}

// Returns every limit under the name that refusals use, in ascending order of names.
std::vector<NamedLimit> limits_of(const Host& host) {
  std::vector<NamedLimit> all = {
      {"backup_files", limits::kMaxBackupFiles},
      {"backups", static_cast<double>(host.backups.max()), static_cast<double>(host.backups.used())},
      {"blocks", limits::kMaxBlocks},
      {"calls", static_cast<double>(host.calls.max()), static_cast<double>(host.calls.used())},
      {"connection_memory_bytes", static_cast<double>(host.memory.connection_share())},
      {"identity_memory_bytes", static_cast<double>(host.memory.connection_share())},
      {"coordinate", limits::kMaxCoordinate},
      {"health_checks", kMaxHealthChecks, static_cast<double>(host.health_checks.used())},
      {"health_watchers", kMaxHealthWatchers, static_cast<double>(host.health_watchers.used())},
      {"history_bytes", static_cast<double>(limits::kMaxHistoryBytes)},
      {"history_ticks", limits::kMaxHistoryTicks},
      {"http_connections", kMaxHttpConnections},
      {"http_request_bytes", kMaxHttpRequestBytes},
      {"ignored_ids", limits::kMaxIgnoredIds},
      {"instances", limits::kMaxInstances},
      {"interpolated_bytes", static_cast<double>(limits::kMaxInterpolatedBytes)},
      {"label_length", limits::kMaxLabelLength},
      {"labelled_scenes", kMaxLabelledScenes},
      {"labels", limits::kMaxLabels},
      {"lease_ms", limits::kMaxLeaseMs},
      {"leases", limits::kMaxLeases},
      {"expire_ticks", static_cast<double>(limits::kMaxExpireTicks)},
      {"listed_item_errors", limits::kMaxListedItemErrors},
      {"reflection_request_bytes", kMaxReflectionRequestBytes},
      {"reflections", kMaxReflections, static_cast<double>(host.reflections.used())},
      {"max_reply_bytes", limits::kMaxReplyBytes},
      {"max_results", limits::kMaxMaxResults},
      {"memory_bytes", static_cast<double>(host.memory.limit()), static_cast<double>(host.memory.used())},
      {"mesh_parts", limits::kMaxMeshParts},
      {"mesh_triangles", limits::kMaxMeshTriangles},
      {"mesh_vertices", limits::kMaxMeshVertices},
      {"meshes", static_cast<double>(host.config.max_meshes), static_cast<double>(host.registry.mesh_count())},
      {"name_length", limits::kMaxNameLength},
      {"nearest", limits::kMaxNearest},
      {"objects", limits::kMaxObjects},
      {"only_groups", limits::kMaxOnlyGroups},
      {"page_size", limits::kMaxPageSize},
      {"parts", limits::kMaxParts},
      {"pair_neighbours", limits::kMaxPairNeighbours},
      {"cell_planes", limits::kMaxCellPlanes},
      {"planes", limits::kMaxPlanes},
      {"region_planes", limits::kMaxRegionPlanes},
      {"sight_eyes", limits::kMaxSightEyes},
      {"sight_samples", limits::kMaxSightSamples},
      {"sight_segments", limits::kMaxSightSegments},
      {"idle_ttl_s", limits::kMaxLifetimeSeconds},
      {"mesh_grace_s", limits::kMaxLifetimeSeconds},
      {"pending_changes", limits::kMaxPendingChanges},
      {"pinned_bytes", static_cast<double>(host.pinned_limit() != 0 ? host.pinned_limit() : limits::kPinnedBytes)},
      {"queries", limits::kMaxQueries},
      {"rays", limits::kMaxRays},
      {"receive_bytes", static_cast<double>(host.config.max_receive_bytes)},
      {"recent_revisions", limits::kRecentRevisions},
      {"request_id_length", kMaxRequestIdLength},
      {"scenes", static_cast<double>(host.config.max_scenes), static_cast<double>(host.registry.scene_count())},
      {"slow_query_lines", kMaxSlowQueryLines},
      {"streams", static_cast<double>(host.streams.max()), static_cast<double>(host.streams.used())},
      {"threads", static_cast<double>(host.pool.threads())},
      {"unknown_fields", kMaxUnknownFields},
      {"update_items", limits::kMaxUpdateItems},
      {"update_lists", limits::kMaxUpdateLists},
      {"update_messages", limits::kMaxUpdateMessages},
      {"wait_ms", limits::kDefaultWaitMs},
      {"wire_fields", kMaxWireFields},
      {"writers", limits::kMaxWriters},
  };
  add_connections(host, all);
  add_queues(host, all);
  add_memory_lines(host, all);
  add_refusals(host, all);
  std::sort(all.begin(), all.end(), [](const NamedLimit& a, const NamedLimit& b) { return a.name < b.name; });
  return all;
}

void get_server(Host& host, const Caller& caller, v1::GetServerResponse& response) {
  // The used values of some limits would reveal the number and size of scenes that the caller may not read.
  const bool shows_use = caller.may(Right::kMetrics, "") || caller.administers_all();
  response.set_version(kVersion);
  response.set_instruction_set(std::string(instruction_set()));
  for (const absl::string_view feature : {"after_t",
                                          "anchors",
                                          "as_of",
                                          "backup",
                                          "balls",
                                          "boxes",
                                          "by_list",
                                          "capsules",
                                          "cell_size",
                                          "cells",
                                          "compounds",
                                          "contains",
                                          "continues",
                                          "count_only",
                                          "download_mesh",
                                          "durability_local",
                                          "durability_replicated",
                                          "expire_ticks",
                                          "frustums",
                                          "history",
                                          "idle_ttl",
                                          "latest_wins",
                                          "leases",
                                          "lookup",
                                          "mesh_grace",
                                          "nearest",
                                          "pairs",
                                          "rays",
                                          "sight",
                                          "static_from",
                                          "step",
                                          "sweeps"})
    if (serves(host, feature)) response.add_features(std::string(feature));
  for (const NamedLimit& limit : limits_of(host)) {
    v1::Limit* out = response.add_limits();
    out->set_name(limit.name);
    out->set_value(limit.value);
    if (!shows_use) continue;
    out->set_used(limit.used);
    out->set_refused(limit.refused);
  }
  response.set_insecure(host.config.insecure);
  response.set_use_hidden(!shows_use);
  response.set_http_port(host.http_port);
  response.set_http_host(host.http_host);
  if (host.cluster == nullptr) return;
  *response.mutable_cluster() = host.cluster->describe();
  if (!shows_use) response.mutable_cluster()->clear_engine();
}

}  // namespace

std::vector<BlockingMethod> server_methods(Host& host) {
  BlockingMethod get;
  get.path = "/locus.v1.ServerService/GetServer";
  get.rpc = Rpc::kGetServer;
  get.while_closed = WhileClosed::kServe;
  get.body = unary_body<v1::GetServerRequest, v1::GetServerResponse>(
      [&host](const Caller& caller, const v1::GetServerRequest&, v1::GetServerResponse& response) {
        get_server(host, caller, response);
        return absl::OkStatus();
      });
  BlockingMethod quotas;
  quotas.path = "/locus.v1.ServerService/GetQuotas";
  quotas.rpc = Rpc::kGetQuotas;
  quotas.body = unary_body<v1::GetQuotasRequest, v1::GetQuotasResponse>(
      [&host](const Caller& caller, const v1::GetQuotasRequest& request, v1::GetQuotasResponse& response) {
        return get_quotas(host, caller, request, response);
      });
  BlockingMethod backup;
  backup.path = "/locus.v1.ServerService/Backup";
  backup.rpc = Rpc::kBackup;
  backup.is_change = true;  // a copy of all data is audited like a change
  backup.body =
      streaming_body<v1::BackupRequest>([&host](const Caller& caller, const v1::BackupRequest&, MessageStream& stream) {
        return back_up(host, caller, stream);
      });
  BlockingMethod move;
  move.path = "/locus.v1.ServerService/MoveScene";
  move.rpc = Rpc::kMoveScene;
  move.is_change = true;
  move.body = unary_body<v1::MoveSceneRequest, v1::MoveSceneResponse>(
      [&host](const Caller& caller, const v1::MoveSceneRequest& request, v1::MoveSceneResponse& response) {
        return move_scene(caller, host, request, response);
      });
  std::vector<BlockingMethod> methods;
  methods.push_back(std::move(get));
  methods.push_back(std::move(quotas));
  methods.push_back(std::move(backup));
  methods.push_back(std::move(move));
  return methods;
}

}  // namespace locus::server
