// Figures that `locus top` shows: rates, quantiles and latest values, computed from two scrapes of one server's
// metrics. Plain data and a function without state. A figure that cannot be computed is null: a rate is null if its
// counter decreased, because the server restarted; a quantile or a mean is null if there was nothing to measure.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TOP_TOP_FIGURES_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TOP_TOP_FIGURES_H_

#include <vector>

#include "client/cli/extras/top/metrics_text.h"
#include "client/cli/output.h"

namespace locus::cli {

struct TopFigures {
  Json server;                // one object: memory_bytes, connections, queue ...; in a cluster members, engine_up ...
  std::vector<Json> rpcs;     // one row per rpc called between the scrapes: rpc, per_s, p50_ms, p99_ms
  std::vector<Json> queries;  // one row per kind of query: kind, per_s, us_each
  std::vector<Json> scenes;   // one row per scene: scene, revisions_per_s, objects, memory_bytes ...; in a cluster role
};

// Returns the figures of the interval between two scrapes. `seconds` is the length of the interval.
TopFigures top_figures(const std::vector<MetricSample>& before, const std::vector<MetricSample>& now, double seconds);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TOP_TOP_FIGURES_H_
