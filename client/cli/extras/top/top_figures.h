// Figures of `locus top`: rates, quantiles and the latest state, computed from two scrapes of one server. Plain data
// and functions without state. A figure that cannot be computed is null: the rate of a counter that was reset by a
// restart of the server, or a quantile of no calls.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TOP_TOP_FIGURES_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TOP_TOP_FIGURES_H_

#include <vector>

#include "client/cli/extras/top/metrics_text.h"
#include "client/cli/output.h"

namespace locus::cli {

struct TopFigures {
  Json server;                // one object: memory_bytes, connections, queue ...
  std::vector<Json> rpcs;     // rpcs called between the scrapes: rpc, per_s, p50_ms, p99_ms
  std::vector<Json> queries;  // one row a kind: kind, per_s, us_each
  std::vector<Json> scenes;   // scene, revisions_per_s, objects, memory_bytes ...
};

// Returns the figures of the interval between two scrapes, which is `seconds` long.
TopFigures top_figures(const std::vector<MetricSample>& before, const std::vector<MetricSample>& now, double seconds);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TOP_TOP_FIGURES_H_
