#include "server/services/scrape.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/index/bvh/kernels/dispatch.h"
#include "server/config/version.h"
#include "server/observability/call_figures.h"
#include "server/observability/process_figures.h"

namespace locus::server {
namespace {

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
  figures.history_bytes = status.history_bytes;
  figures.history_ticks = status.recorded_ticks;
  figures.pinned_bytes = status.pinned_bytes;
  figures.log_bytes = scene.log_position().bytes;
  figures.pending_changes = std::max(status.pending_changes, host.changes.pending(snapshot->epoch));
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

void add_queues(const Host& host, MetricPage& page) {
  const SchedulerStats queries = host.scheduler.stats();
  const UpdateQueueStats updates = host.updates.stats();
  constexpr auto kSmall = static_cast<size_t>(JobClass::kSmall);
  constexpr auto kLarge = static_cast<size_t>(JobClass::kLarge);
  page.begin("locus_queue_depth",
             "Batches that wait or are in work: small and large ones of queries by estimated cost, and updates.",
             MetricKind::kGauge);
  page.add({{"class", "small_queries"}}, static_cast<double>(queries.jobs[kSmall]));
  page.add({{"class", "large_queries"}}, static_cast<double>(queries.jobs[kLarge]));
  page.add({{"class", "updates"}}, static_cast<double>(updates.updates));
  page.begin("locus_queue_seconds", "Estimated processor time of the queries that wait or are in work, in seconds.",
             MetricKind::kGauge);
  page.add({{"class", "small_queries"}}, static_cast<double>(queries.nanoseconds[kSmall]) * 1e-9);
  page.add({{"class", "large_queries"}}, static_cast<double>(queries.nanoseconds[kLarge]) * 1e-9);
  page.add_one("locus_updates_coalesced_total", "Updates that became visible only together with a later one.",
               MetricKind::kCounter, static_cast<double>(updates.coalesced));
  page.add_one("locus_slow_queries_total", "Batches of queries that took longer than --slow-query-ms.",
               MetricKind::kCounter, static_cast<double>(host.slow_queries.count()));
}

void add_storage(const Host& host, MetricPage& page) {
  const SnapshotterStats snapshots = host.snapshots.stats();
  page.add_one("locus_snapshots_total", "Snapshots that took the place of a scene's log.", MetricKind::kCounter,
               static_cast<double>(snapshots.written));
  page.add_one("locus_snapshot_failures_total", "Snapshots that could not be written.", MetricKind::kCounter,
               static_cast<double>(snapshots.failed));
  page.add_one("locus_scenes_damaged", "Scenes that are not served because what the disk has of them is damaged.",
               MetricKind::kGauge, static_cast<double>(host.registry.damaged_scenes().size()));
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

HttpServer::Pages Scrape::pages() {
  return {{"/healthz", [] { return HttpReply{.body = "alive\n"}; }},
          {"/metrics", [this] { return HttpReply{.content_type = MetricPage::kContentType, .body = metrics()}; }},
          {"/readyz", [this] { return readiness(); }}};
}

std::string Scrape::metrics() {
  const MutexLock lock(mutex_);
  MetricPage page;
  add_server(host_, readiness().code == 200, page);
  add_queues(host_, page);
  add_storage(host_, page);
  add_call_figures(host_.metrics.read(), page);
  std::vector<SceneFigures> scenes;
  for (const ScenePtr& scene : host_.registry.list_scenes("", std::numeric_limits<size_t>::max()))
    scenes.push_back(figures_of(host_, *scene));
  add_scene_figures(labels_.label(scenes), page);
  add_process_figures(read_process(addresses_), page);
  return page.text();
}

}  // namespace locus::server
