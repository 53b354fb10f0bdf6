// Converts the counters of calls to metrics. Function without state.
#ifndef LOCUS_SERVER_OBSERVABILITY_CALL_FIGURES_H_
#define LOCUS_SERVER_OBSERVABILITY_CALL_FIGURES_H_

#include "server/observability/metric_page.h"
#include "server/observability/metrics.h"

namespace locus::server {

// Adds all call metrics to the page, each metric name once. For an rpc that was never called, adds only the count of
// its OK calls, which is 0, so that rates start at 0 and the page stays short.
void add_call_figures(const MetricCounts& counts, MetricPage& page);

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_CALL_FIGURES_H_
