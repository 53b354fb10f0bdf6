// Measurements of this process, read from the system for /metrics: the measurements that all client libraries of
// Prometheus report, and the number of open connections. Functions without state; any thread.
#ifndef LOCUS_SERVER_OBSERVABILITY_PROCESS_FIGURES_H_
#define LOCUS_SERVER_OBSERVABILITY_PROCESS_FIGURES_H_

#include <cstdint>
#include <string>
#include <vector>

#include "server/observability/metric_page.h"

namespace locus::server {

struct ProcessFigures {
  double cpu_seconds = 0;  // user and system time
  uint64_t resident_bytes = 0;
  uint64_t threads = 0;
  uint64_t open_files = 0;
  uint64_t max_files = 0;
  uint64_t connections = 0;  // open connections from clients to the addresses given to read_process()
  double start_seconds = 0;  // start of the process, in seconds since 1970
};

// Returns the process's resident memory in bytes. Costs one read of /proc.
uint64_t resident_bytes();

// Reads all figures. `addresses` are the addresses whose connections are counted, as texts for parse_listen_address();
// invalid texts are ignored. A figure that cannot be read is 0. Costs one to three system calls for each open file.
ProcessFigures read_process(const std::vector<std::string>& addresses);

// Adds the figures to the page.
void add_process_figures(const ProcessFigures& process, MetricPage& page);

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_PROCESS_FIGURES_H_
