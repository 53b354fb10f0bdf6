// Load generator of `locus demo`: one thread moves every object each tick while two threads send queries.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_LOAD_H_
#define LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_LOAD_H_

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/extras/demo/demo_queries.h"
#include "client/lib/client.h"

namespace locus::cli {

struct LoadOptions {
  std::string scene;
  uint64_t ticks = 150;
  double ticks_a_second = 30;
  uint64_t seed = 1;
  std::function<void(uint64_t ticks)> on_tick = {};  // called in the calling thread with the number of ticks sent
};

struct Sample {
  v1::QueryBatch batch;
  v1::QueryResult result;
};

// Measurements of one kind of query, or of all updates.
struct LoadFigures {
  uint64_t items = 0;  // number of queries sent, or of objects moved
  uint64_t found = 0;
  std::vector<double> milliseconds;  // latency of each batch, in ms
  std::vector<Sample> samples;       // a bounded number of batches, spread evenly over the run

  double percentile(double fraction) const;
};

struct LoadResult {
  double seconds = 0;
  LoadFigures moves;
  std::array<LoadFigures, kDemoKinds.size()> queries;
  uint64_t first_revision = 0, last_revision = 0;
  uint64_t last_tick = 0;
};

// Runs the load until all ticks are acknowledged. The calling thread sends the moves, two more threads send queries.
// Returns the first error of any of these threads.
absl::StatusOr<LoadResult> run_load(const client::Client& client, const DemoWorld& world, const LoadOptions& options);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_LOAD_H_
