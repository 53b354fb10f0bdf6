// What `locus top` shows: two scrapes of one server as rates, quantiles and the latest state. Plain data and functions
// without state; a figure that cannot be told (a counter that fell since the server started again, a quantile of no
// calls) is null.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TOP_TOP_FIGURES_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TOP_TOP_FIGURES_H_

#include <vector>

#include "client/cli/extras/top/metrics_text.h"
#include "client/cli/output.h"

namespace locus::cli {

struct TopFigures {
  Json server;                // one object: memory_bytes, connections, queue ...
  std::vector<Json> rpcs;     // those called in between: rpc, per_s, p50_ms, p99_ms
  std::vector<Json> queries;  // by kind: kind, per_s, us_each
  std::vector<Json> scenes;   // scene, revisions_per_s, objects, memory_bytes ...
};

// `seconds` lie between the two.
TopFigures top_figures(const std::vector<MetricSample>& before, const std::vector<MetricSample>& now, double seconds);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TOP_TOP_FIGURES_H_
