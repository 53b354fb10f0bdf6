#include "server/services/scrape.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "server/config/version.h"
#include "server/host/memory_lines.h"
#include "server/observability/call_figures.h"
#include "server/observability/process_figures.h"
#include "server/scheduling/allocator_use.h"
#include "server/scheduling/clocks.h"
#include "server/security/access_control.h"
#include "server/security/rights.h"
#include "server/services/cluster/cluster_scenes.h"
#include "server/services/connections.h"
#include "server/services/quota_report.h"

namespace locus::server {
namespace {

constexpr const char* kMetricsPage = "/metrics";

SceneFigures figures_of(const Host& host, const Scene& scene) {
  const SnapshotPtr snapshot = scene.latest();
  const SceneStatus status = scene.status();
  SceneFigures figures;
  figures.name = scene.name();
  figures.revision = snapshot->revision;
  figures.objects = snapshot->objects.size();
  figures.instances = snapshot->statics->size();
  figures.triangles = snapshot->statics->triangle_count();
  figures.memory_bytes = status.memory_bytes;
  figures.mesh_bytes = status.mesh_bytes;
  figures.recent_bytes = status.recent_bytes;
  figures.history_bytes = status.history_bytes;
  figures.history_ticks = status.recorded_ticks;
  figures.history_asked_ticks = scene.spec().history.ticks;
  figures.history_forgotten_ticks = status.forgotten_ticks;
  figures.history_short = forgets_early(status.past_limit) ? 1 : 0;
  figures.pinned_bytes = status.pinned_bytes;
  figures.log_bytes = scene.log_position().bytes;
  figures.pending_changes = std::max(status.pending_changes, host.changes.pending(snapshot->epoch));
  if (host.cluster != nullptr && host.cluster->placement_of(scene).role() == v1::SCENE_ROLE_LEADING)
    figures.leading = 1;
  return figures;
}

void add_server(const Host& host, bool ready, MetricPage& page) {
  page.begin("locus_build_info", "Always 1; the labels say what runs.", MetricKind::kGauge);
  page.add({{"version", kVersion}, {"instruction_set", std::string(instruction_set())}}, 1);
  page.add_one("locus_ready", "1 while calls are served, 0 while the server starts or drains.", MetricKind::kGauge,
               ready ? 1 : 0);
  const std::pair<const char*, std::pair<double, double>> limits[] = {
      {"calls", {host.calls.max(), host.calls.used()}},
      {"memory_bytes", {static_cast<double>(host.memory.limit()), static_cast<double>(host.memory.used())}},
      {"meshes", {host.config.max_meshes, static_cast<double>(host.registry.mesh_count())}},
      {"scenes", {host.config.max_scenes, static_cast<double>(host.registry.scene_count())}},
      {"streams", {host.streams.max(), host.streams.used()}},
  };
  page.begin("locus_limit", "Limits of the server that can be used up; `locus limits` lists all.", MetricKind::kGauge);
  for (const auto& [name, numbers] : limits) page.add({{"limit", name}}, numbers.first);
  page.begin("locus_limit_used", "How much of a limit is in use.", MetricKind::kGauge);
  for (const auto& [name, numbers] : limits) page.add({{"limit", name}}, numbers.second);
}

void add_connections(const Host& host, MetricPage& page) {
  const std::vector<ConnectionLimit> limits = connection_limits(host.config, host.connections);
  page.begin("locus_connection_limit",
             "Limits on connections and on what one may send, by the names of `locus limits`; 0 = none.",
             MetricKind::kGauge);
  for (const ConnectionLimit& limit : limits) page.add({{"limit", limit.name}}, limit.value);
  page.begin("locus_connections_refused_total",
             "Connections that were refused or closed, by the limit or kind of misuse.", MetricKind::kCounter);
  for (const ConnectionLimit& limit : limits) page.add({{"limit", limit.name}}, static_cast<double>(limit.refused));
  for (const ConnectionMisuse& misuse : connection_misuses(host.connections))
    page.add({{"limit", misuse.name}}, static_cast<double>(misuse.refused));
}

void add_queues(const Host& host, MetricPage& page) {
  const SchedulerStats queries = host.scheduler.stats();
  const UpdateQueueStats updates = host.updates.stats();
  constexpr auto kSmall = static_cast<size_t>(JobClass::kSmall);
  constexpr auto kLarge = static_cast<size_t>(JobClass::kLarge);
  page.begin("locus_queue_depth",
             "Waiting and running batches: queries, small and large by estimated cost, and updates.",
             MetricKind::kGauge);
  page.add({{"class", "small_queries"}}, static_cast<double>(queries.jobs[kSmall]));
  page.add({{"class", "large_queries"}}, static_cast<double>(queries.jobs[kLarge]));
  page.add({{"class", "updates"}}, static_cast<double>(updates.updates));
  page.begin("locus_queue_seconds", "Estimated processor time of the waiting and running queries, in seconds.",
             MetricKind::kGauge);
  page.add({{"class", "small_queries"}}, static_cast<double>(queries.nanoseconds[kSmall]) * 1e-9);
  page.add({{"class", "large_queries"}}, static_cast<double>(queries.nanoseconds[kLarge]) * 1e-9);
  page.add_one("locus_updates_coalesced_total", "Updates that became visible only together with a later one.",
               MetricKind::kCounter, static_cast<double>(updates.coalesced));
  page.add_one("locus_slow_queries_total", "Batches of queries that took longer than --slow-query-ms.",
               MetricKind::kCounter, static_cast<double>(host.slow_queries.count()));
}

void add_memory(const Host& host, MetricPage& page) {
  const std::vector<MemoryLineUse> lines = memory_lines(host.memory, host.registry, host.log);
  page.begin("locus_memory_bytes", "Memory by what it is used for: claimed by work in progress, or measured.",
             MetricKind::kGauge);
  for (const MemoryLineUse& line : lines)
    page.add({{"line", line.name}, {"counted", line.claimed ? "claimed" : "measured"}}, static_cast<double>(line.used));
  page.begin("locus_memory_ceiling_bytes", "Memory at which a line gives way or is refused.", MetricKind::kGauge);
  for (const MemoryLineUse& line : lines) page.add({{"line", line.name}}, static_cast<double>(line.ceiling));
  page.begin("locus_memory_refusals_total", "Claims of memory that were refused.", MetricKind::kCounter);
  for (size_t i = 0; i < kMemoryLines; ++i) {
    const auto line = static_cast<MemoryLine>(i);
    page.add({{"line", std::string(memory_line_name(line))}}, static_cast<double>(host.memory.refused(line)));
  }
  const AllocatorUse allocator = allocator_use(host.memory.used());
  page.add_one("locus_memory_live_bytes", "Bytes of live allocations.", MetricKind::kGauge,
               static_cast<double>(allocator.live));
  page.add_one("locus_memory_reusable_bytes",
               "Free bytes that the allocator holds for later allocations and has not returned to the system.",
               MetricKind::kGauge, static_cast<double>(allocator.reusable));
  page.add_one("locus_memory_trimmed_bytes_total", "Bytes by which histories were shortened as memory ran short.",
               MetricKind::kCounter, static_cast<double>(host.memory_keeper.trimmed_bytes()));
  page.add_one("locus_memory_revoked_bytes_total", "Bytes held by readers that were cancelled as memory ran short.",
               MetricKind::kCounter, static_cast<double>(host.memory_keeper.revoked_bytes()));
}

void add_quotas(const Host& host, MetricPage& page) {
  page.begin("locus_quota_max_use",
             "Largest share of a quota that an identity or connection uses; `locus quota --all` lists them.",
             MetricKind::kGauge);
  for (const auto& [quota, share] : largest_quota_shares(host)) page.add({{"quota", quota}}, share);
}

void add_storage(const Host& host, MetricPage& page) {
  const SnapshotterStats snapshots = host.snapshots.stats();
  page.add_one("locus_snapshots_total", "Snapshots that replaced a scene's log.", MetricKind::kCounter,
               static_cast<double>(snapshots.written));
  page.add_one("locus_snapshot_failures_total", "Snapshots that could not be written.", MetricKind::kCounter,
               static_cast<double>(snapshots.failed));
  page.add_one("locus_scenes_expired_total", "Scenes that were deleted because no call used them.",
               MetricKind::kCounter, static_cast<double>(host.idle_scenes.deleted()));
  page.add_one("locus_meshes_collected_total", "Meshes that were deleted because no scene used them.",
               MetricKind::kCounter, static_cast<double>(host.mesh_collector.deleted()));
  page.add_one("locus_leases_ended_total", "Leases that ended because their writers were silent.", MetricKind::kCounter,
               static_cast<double>(host.leases.ended()));
  page.add_one("locus_scenes_damaged", "Scenes that are not served because their stored data is damaged.",
               MetricKind::kGauge, static_cast<double>(host.registry.damaged_scenes().size()));
}

// Adds the metrics that only a member of a cluster has.
void add_cluster(const Host& host, MetricPage& page) {
  const ClusterScenes::Figures figures = host.cluster->figures();
  page.add_one("locus_cluster_members", "Living members of the cluster that this one knows, with itself.",
               MetricKind::kGauge, static_cast<double>(figures.members));
  page.add_one("locus_cluster_leading", "Scenes that this member leads.", MetricKind::kGauge,
               static_cast<double>(figures.leading));
  page.add_one("locus_cluster_leaderships_total",
               "Leaderships that began here: scenes created, moved here or taken over.", MetricKind::kCounter,
               static_cast<double>(figures.begun));
  page.add_one("locus_cluster_fenced_total", "Leaderships that ended because another member took the scene over.",
               MetricKind::kCounter, static_cast<double>(figures.fenced));
  page.add_one("locus_cluster_engine_up", "1 if the engine answered this member's last beat, otherwise 0.",
               MetricKind::kGauge, figures.engine_answers ? 1 : 0);
  page.begin("locus_cluster_append_seconds",
             "Time from an append of updates to the engine's acknowledgement, with the wait for its transaction.",
             MetricKind::kHistogram);
  page.add({}, figures.appends);
}

void add_file_loads(const Host& host, MetricPage& page) {
  const std::pair<const char*, const FileLoads&> all[] = {{"access", host.access_loads}, {"tls", host.tls_loads}};
  page.begin("locus_file_reloads_total",
             "Times that changed files were put into use: the access file, tokens and JWKS file, or those of TLS.",
             MetricKind::kCounter);
  for (const auto& [files, loads] : all) page.add({{"files", files}}, static_cast<double>(loads.reloads()));
  page.begin("locus_file_reload_failures_total", "Times that changed files could not be used; the log says why.",
             MetricKind::kCounter);
  for (const auto& [files, loads] : all) page.add({{"files", files}}, static_cast<double>(loads.failures()));
  page.begin("locus_files_loaded_time_seconds",
             "When the files in use were read, in seconds since 1970; 0 if there are none.", MetricKind::kGauge);
  for (const auto& [files, loads] : all) page.add({{"files", files}}, static_cast<double>(loads.loaded_s()));
  page.begin("locus_files_refused", "1 if older files are in use because the newest cannot be used, otherwise 0.",
             MetricKind::kGauge);
  for (const auto& [files, loads] : all) page.add({{"files", files}}, loads.refused() ? 1 : 0);
}

void audit_refusal(const Host& host, const HttpRequest& reader, const Identity& identity, const absl::Status& status) {
  if (host.access->audit() == nullptr) return;
  AuditEntry entry;
  entry.unix_ms = unix_milliseconds();
  entry.principal = identity.principal;
  entry.peer = reader.peer;
  entry.address = reader.address;
  entry.rpc = kMetricsPage;
  entry.code = status.code();
  entry.text = std::string(status.message());
  host.access->audit()->write(std::move(entry));
}

// Returns OK if the reader may read /metrics. Returns UNAUTHENTICATED if the reader has no credentials or they are not
// accepted, and PERMISSION_DENIED if they are accepted but the reader lacks the right.
absl::Status check_reader(const Host& host, const HttpRequest& reader) {
  if (host.access == nullptr || !host.access->enabled()) return absl::OkStatus();
  Credentials credentials;
  credentials.bearer = bearer_of_header(reader.authorization);
  credentials.certificate_name = reader.certificate_name;
  const absl::StatusOr<IdentityPtr> identity = host.access->authenticate(credentials);
  if (identity.ok() && host.access->rules()->allows(**identity, kMetricsPageRight)) return absl::OkStatus();
  const Identity& reader_identity = identity.ok() ? **identity : *anonymous_identity();
  absl::Status status = identity.status();
  if (status.ok() && reader_identity.kind == IdentityKind::kAnonymous)
    status = absl::UnauthenticatedError(
        "this page needs the right metrics: send a token as header `Authorization: Bearer TOKEN`");
  if (status.ok())
    status = absl::PermissionDeniedError(
        absl::StrCat(reader_identity.principal, " lacks the right metrics; ask the operator for a line `grant` in the ",
                     "access file"));
  audit_refusal(host, reader, reader_identity, status);
  return status;
}

}  // namespace

void Scrape::serving(std::vector<std::string> addresses) {
  const MutexLock lock(mutex_);
  addresses_ = std::move(addresses);
  serving_ = true;
}

HttpReply Scrape::readiness() const {
  if (host_.recovering.load()) return {.code = 503, .body = "recovering\n"};
  if (!serving_) return {.code = 503, .body = "starting\n"};
  if (host_.drain.draining()) return {.code = 503, .body = "draining\n"};
  return {.body = "ready\n"};
}

HttpPages Scrape::pages() {
  return {{"/healthz", [](const HttpRequest&) { return HttpReply{.body = "alive\n"}; }},
          {kMetricsPage, [this](const HttpRequest& reader) { return metrics_for(reader); }},
          {"/readyz", [this](const HttpRequest&) { return readiness(); }}};
}

HttpReply Scrape::metrics_for(const HttpRequest& reader) {
  if (const absl::Status status = check_reader(host_, reader); !status.ok()) {
    const int code = absl::IsUnauthenticated(status) ? 401 : 403;
    return {.code = code, .body = absl::StrCat(status.message(), "\n")};
  }
  return {.content_type = MetricPage::kContentType, .body = metrics()};
}

std::string Scrape::metrics() {
  const MutexLock lock(mutex_);
  MetricPage page;
  add_server(host_, readiness().code == 200, page);
  add_connections(host_, page);
  add_queues(host_, page);
  add_memory(host_, page);
  add_quotas(host_, page);
  add_storage(host_, page);
  add_file_loads(host_, page);
  add_call_figures(host_.metrics.read(), page);
  std::vector<SceneFigures> scenes;
  for (const ScenePtr& scene : host_.registry.list_scenes("", std::numeric_limits<size_t>::max()))
    scenes.push_back(figures_of(host_, *scene));
  const std::vector<SceneFigures> labelled = labels_.label(scenes);
  add_scene_figures(labelled, page);
  if (host_.cluster != nullptr) {
    add_led_scenes(labelled, page);
    add_cluster(host_, page);
  }
  add_process_figures(read_process(addresses_), page);
  return page.text();
}

}  // namespace locus::server
