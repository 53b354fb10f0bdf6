#include "client/cli/extras/top/top_figures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "absl/strings/numbers.h"

namespace locus::cli {
namespace {

using MetricSamples = std::vector<MetricSample>;
using Key = std::pair<std::string, std::string>;  // name and value of one label

// Returns the values of the metric `name`, keyed by the value of `label` and summed over all other labels.
std::map<std::string, double> by_label(const MetricSamples& samples, absl::string_view name, absl::string_view label) {
  std::map<std::string, double> sums;
  for (const MetricSample& sample : samples)
    if (sample.name == name) sums[std::string(sample.label(label))] += sample.value;
  return sums;
}

double sum_of(const MetricSamples& samples, absl::string_view name) {
  double sum = 0;
  for (const MetricSample& sample : samples)
    if (sample.name == name) sum += sample.value;
  return sum;
}

double at(const std::map<std::string, double>& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() ? 0 : found->second;
}

// Returns `value` as a JSON integer if it is integral, else rounded to three decimals, or null if it is not finite.
Json number(double value) {
  constexpr double kExactIntegers = 9007199254740992.0;
  if (!std::isfinite(value)) return nullptr;
  if (value == std::floor(value) && std::abs(value) < kExactIntegers) return static_cast<int64_t>(value);
  return std::round(value * 1000) / 1000;
}

Json rate(double before, double now, double seconds) {
  if (now < before || seconds <= 0) return nullptr;
  return number(std::round((now - before) / seconds * 10) / 10);
}

// Histogram: maps the upper bound of each bucket, in seconds, to the number of durations that are at most this long.
using Buckets = std::map<double, double>;

Buckets buckets_of(const MetricSamples& samples, absl::string_view name, const Key& of) {
  Buckets buckets;
  for (const MetricSample& sample : samples) {
    double bound = 0;
    if (sample.name != name || (!of.first.empty() && sample.label(of.first) != of.second)) continue;
    if (absl::SimpleAtod(sample.label("le"), &bound)) buckets[bound] += sample.value;
  }
  return buckets;
}

Buckets minus(const Buckets& now, const Buckets& before) {
  Buckets rest;
  for (const auto& [bound, count] : now) {
    const auto old = before.find(bound);
    rest[bound] = count - (old == before.end() ? 0 : old->second);
  }
  return rest;
}

// Returns the quantile `share` (0 .. 1) in milliseconds, interpolated linearly within its bucket as Prometheus's
// histogram_quantile() does. Returns null for an empty histogram.
Json quantile_ms(const Buckets& buckets, double share) {
  constexpr double kMsASecond = 1000;
  if (buckets.empty() || buckets.rbegin()->second <= 0) return nullptr;
  const double rank = share * buckets.rbegin()->second;
  double low_bound = 0;
  double low_count = 0;
  for (const auto& [bound, count] : buckets) {
    if (count >= rank && count > low_count) {
      if (!std::isfinite(bound)) return number(low_bound * kMsASecond);
      return number((low_bound + (bound - low_bound) * (rank - low_count) / (count - low_count)) * kMsASecond);
    }
    low_bound = bound;
    low_count = std::max(low_count, count);
  }
  return nullptr;
}

// Adds the members and the engine, if the server belongs to a cluster.
void add_cluster(const MetricSamples& before, const MetricSamples& now, Json& server) {
  const std::map<std::string, double> members = by_label(now, "locus_cluster_members", "");
  if (members.empty()) return;
  const Buckets appends = minus(buckets_of(now, "locus_cluster_append_seconds_bucket", {}),
                                buckets_of(before, "locus_cluster_append_seconds_bucket", {}));
  server["members"] = number(sum_of(now, "locus_cluster_members"));
  server["leading"] = number(sum_of(now, "locus_cluster_leading"));
  server["engine_up"] = sum_of(now, "locus_cluster_engine_up") == 1;
  server["append_p99_ms"] = quantile_ms(appends, 0.99);
}

Json server_of(const MetricSamples& before, const MetricSamples& now, double seconds) {
  const std::map<std::string, double> limits = by_label(now, "locus_limit", "limit");
  const std::map<std::string, double> used = by_label(now, "locus_limit_used", "limit");
  const std::map<std::string, double> queue = by_label(now, "locus_queue_depth", "class");
  const Buckets lag = minus(buckets_of(now, "locus_update_lag_seconds_bucket", {}),
                            buckets_of(before, "locus_update_lag_seconds_bucket", {}));
  const auto rate_of = [&](absl::string_view name) { return rate(sum_of(before, name), sum_of(now, name), seconds); };
  Json server = {{"ready", sum_of(now, "locus_ready") == 1},
                 {"cpu_cores", rate_of("process_cpu_seconds_total")},
                 {"memory_bytes", number(sum_of(now, "process_resident_memory_bytes"))},
                 {"memory_limit_bytes", number(at(limits, "memory_bytes"))},
                 {"connections", number(sum_of(now, "locus_connections_open"))},
                 {"streams", number(sum_of(now, "locus_streams_open"))},
                 {"calls_in_work", number(at(used, "calls"))}};
  for (const auto& [name, depth] : queue) server["queue_" + name] = number(depth);
  server["updates_per_s"] = rate_of("locus_update_items_total");
  server["update_lag_p99_ms"] = quantile_ms(lag, 0.99);
  server["refusals_per_s"] = rate_of("locus_refusals_total");
  add_cluster(before, now, server);
  return server;
}

std::vector<Json> rpcs_of(const MetricSamples& before, const MetricSamples& now, double seconds) {
  std::vector<Json> rows;
  const std::map<std::string, double> old_calls = by_label(before, "locus_calls_total", "rpc");
  for (const auto& [rpc, calls] : by_label(now, "locus_calls_total", "rpc")) {
    if (calls == at(old_calls, rpc)) continue;
    const Key of = {"rpc", rpc};
    const Buckets buckets =
        minus(buckets_of(now, "locus_call_seconds_bucket", of), buckets_of(before, "locus_call_seconds_bucket", of));
    rows.push_back({{"rpc", rpc},
                    {"per_s", rate(at(old_calls, rpc), calls, seconds)},
                    {"p50_ms", quantile_ms(buckets, 0.5)},
                    {"p99_ms", quantile_ms(buckets, 0.99)}});
  }
  return rows;
}

std::vector<Json> queries_of(const MetricSamples& before, const MetricSamples& now, double seconds) {
  constexpr double kMicroseconds = 1e6;
  std::vector<Json> rows;
  const std::map<std::string, double> old_count = by_label(before, "locus_queries_total", "kind");
  const std::map<std::string, double> old_time = by_label(before, "locus_query_block_seconds_sum", "kind");
  const std::map<std::string, double> time = by_label(now, "locus_query_block_seconds_sum", "kind");
  for (const auto& [kind, count] : by_label(now, "locus_queries_total", "kind")) {
    const double asked = count - at(old_count, kind);
    const Json each = asked > 0 ? number((at(time, kind) - at(old_time, kind)) / asked * kMicroseconds) : Json(nullptr);
    rows.push_back({{"kind", kind}, {"per_s", rate(at(old_count, kind), count, seconds)}, {"us_each", each}});
  }
  return rows;
}

// Returns the role of the server for a scene; null for the sum of several scenes.
Json role_of(const std::string& scene, double leading) {
  if (scene == "_other") return nullptr;
  return leading == 1 ? "leading" : "no_leader";
}

std::vector<Json> scenes_of(const MetricSamples& before, const MetricSamples& now, double seconds) {
  std::vector<Json> rows;
  const std::map<std::string, double> old_revisions = by_label(before, "locus_scene_revision", "scene");
  std::map<std::string, std::map<std::string, double>> figures;
  for (const char* name : {"objects", "instances", "memory_bytes", "history_ticks", "history_bytes", "pinned_bytes"})
    figures[name] = by_label(now, std::string("locus_scene_") + name, "scene");
  const std::map<std::string, double> leading = by_label(now, "locus_scene_leading", "scene");
  for (const auto& [scene, revision] : by_label(now, "locus_scene_revision", "scene")) {
    const double old = old_revisions.contains(scene) ? at(old_revisions, scene) : revision;
    rows.push_back({{"scene", scene},
                    {"revision", number(revision)},
                    {"revisions_per_s", rate(old, revision, seconds)},
                    {"objects", number(at(figures["objects"], scene))},
                    {"instances", number(at(figures["instances"], scene))},
                    {"memory_bytes", number(at(figures["memory_bytes"], scene))},
                    {"history_ticks", number(at(figures["history_ticks"], scene))},
                    {"history_bytes", number(at(figures["history_bytes"], scene))},
                    {"pinned_bytes", number(at(figures["pinned_bytes"], scene))}});
    if (!leading.empty()) rows.back()["role"] = role_of(scene, at(leading, scene));
  }
  return rows;
}

}  // namespace

TopFigures top_figures(const std::vector<MetricSample>& before, const std::vector<MetricSample>& now, double seconds) {
  return {.server = server_of(before, now, seconds),
          .rpcs = rpcs_of(before, now, seconds),
          .queries = queries_of(before, now, seconds),
          .scenes = scenes_of(before, now, seconds)};
}

}  // namespace locus::cli
