#include "server/observability/call_figures.h"

#include <string>

namespace locus::server {
namespace {

std::string name_of(size_t rpc) { return std::string(rpc_name(static_cast<Rpc>(rpc))); }

std::string kind_of(size_t kind) { return std::string(block_kind_name(static_cast<BlockKind>(kind))); }

void add_calls(const MetricCounts& counts, MetricPage& page) {
  page.begin("locus_calls_total",
             "Answered calls, by rpc and status code; each message of a stream counts as one call.",
             MetricKind::kCounter);
  for (size_t rpc = 0; rpc < kRpcs; ++rpc)
    for (size_t code = 0; code < kStatusCodes; ++code)
      if (const uint64_t calls = counts.rpcs[rpc].codes[code]; calls > 0 || code == 0)
        page.add({{"rpc", name_of(rpc)}, {"code", absl::StatusCodeToString(static_cast<absl::StatusCode>(code))}},
                 static_cast<double>(calls));
  page.begin("locus_call_seconds", "Time from the arrival of a call, or a stream's message, to its answer, in seconds.",
             MetricKind::kHistogram);
  for (size_t rpc = 0; rpc < kRpcs; ++rpc)
    if (counts.rpcs[rpc].latency.count() > 0) page.add({{"rpc", name_of(rpc)}}, counts.rpcs[rpc].latency);
  page.begin("locus_streams_open", "Open streams.", MetricKind::kGauge);
  for (const Rpc rpc : {Rpc::kStreamUpdates, Rpc::kStreamQueries})
    page.add({{"rpc", std::string(rpc_name(rpc))}}, static_cast<double>(counts.rpcs[static_cast<size_t>(rpc)].open));
  page.begin("locus_refusals_total",
             "Calls and messages that were refused or failed, by reason and by the limit that was hit, if any.",
             MetricKind::kCounter);
  for (const auto& [name, count] : counts.refusals)
    page.add({{"reason", name.first}, {"limit", name.second}}, static_cast<double>(count));
}

void add_queries(const MetricCounts& counts, MetricPage& page) {
  page.begin("locus_queries_total", "Queries answered, by kind.", MetricKind::kCounter);
  for (size_t kind = 0; kind < kBlockKinds; ++kind)
    page.add({{"kind", kind_of(kind)}}, static_cast<double>(counts.queries[kind].queries));
  page.begin("locus_query_work_total",
             "Work of queries, by kind: tree nodes opened, grid cells visited, triangles and objects tested.",
             MetricKind::kCounter);
  for (size_t kind = 0; kind < kBlockKinds; ++kind) {
    const Work& work = counts.queries[kind].work;
    page.add({{"kind", kind_of(kind)}, {"unit", "nodes"}}, static_cast<double>(work.nodes));
    page.add({{"kind", kind_of(kind)}, {"unit", "cells"}}, static_cast<double>(work.cells));
    page.add({{"kind", kind_of(kind)}, {"unit", "tests"}}, static_cast<double>(work.tests));
  }
  page.begin("locus_query_block_seconds",
             "Processor time of answering a block of queries, by kind, summed over all threads, in seconds.",
             MetricKind::kHistogram);
  for (size_t kind = 0; kind < kBlockKinds; ++kind)
    if (counts.queries[kind].latency.count() > 0) page.add({{"kind", kind_of(kind)}}, counts.queries[kind].latency);
}

void add_updates(const MetricCounts& counts, MetricPage& page) {
  page.add_one("locus_update_items_total",
               "Objects inserted, moved, relabelled and removed, and instances moved and relabelled.",
               MetricKind::kCounter, static_cast<double>(counts.update_items));
  page.begin("locus_update_lag_seconds",
             "Time from the arrival of a batch of updates to the publication of its revision, in seconds.",
             MetricKind::kHistogram);
  page.add({}, counts.update_lag);
  page.begin("locus_mesh_build_seconds", "Time that building the tree of an uploaded mesh took, in seconds.",
             MetricKind::kHistogram);
  page.add({}, counts.mesh_builds);
  page.begin("locus_instance_change_seconds",
             "Time from the request to change a scene's instances to the publication of its revision, in seconds.",
             MetricKind::kHistogram);
  page.add({}, counts.instance_changes);
}

}  // namespace

void add_call_figures(const MetricCounts& counts, MetricPage& page) {
  add_calls(counts, page);
  add_queries(counts, page);
  add_updates(counts, page);
}

}  // namespace locus::server
