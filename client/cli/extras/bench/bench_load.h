// Load of `locus bench`: several connections that send batches of one kind, each connection one batch at a time. Plain
// data and functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_BENCH_BENCH_LOAD_H_
#define LOCUS_CLIENT_CLI_EXTRAS_BENCH_BENCH_LOAD_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/extras/demo/demo_random.h"
#include "client/lib/client.h"
#include "core/geometry/aabb.h"

namespace locus::cli {

enum class BenchKind { kRays, kBalls, kBoxes, kNearest, kMoves };

struct BenchLoad {
  BenchKind kind = BenchKind::kRays;
  std::string scene;
  Aabbd bounds;          // queries and objects are placed in it
  uint64_t objects = 0;  // moves: objects with the ids 1 to `objects`
  uint32_t batch = 256;  // queries or moves of a batch
  double seconds = 5;
  uint64_t seed = 1;
};

// Measurements of one kind.
struct BenchFigures {
  uint64_t items = 0;    // queries answered, or objects moved
  uint64_t batches = 0;  // batches that the server did not refuse
  uint64_t refused = 0;  // refused batches, and refused moves of the other batches
  double seconds = 0;
  std::vector<double> milliseconds;  // latency of each batch that was not refused

  double rate() const { return seconds > 0 ? static_cast<double>(items) / seconds : 0; }
};

// Returns the smallest value that is not less than the part `fraction` of the values; 0 without values.
double percentile(std::vector<double> values, double fraction);

// Returns a batch of random queries inside the bounds. Precondition: load.kind is not kMoves.
v1::QueryBatch bench_queries(const BenchLoad& load, DemoRandom& random);

// Returns a batch that inserts `count` balls from the id `first` on, or moves them, at random inside the bounds.
v1::UpdateBatch bench_inserts(const BenchLoad& load, uint64_t first, uint64_t count, DemoRandom& random);
v1::UpdateBatch bench_moves(const BenchLoad& load, uint64_t first, uint64_t count, DemoRandom& random);

// Runs the load for load.seconds on all connections, and then waits for the last answers. Calls `on_progress` from time
// to time in this thread with the number of items so far. Returns the first error that is not a refusal of the server.
absl::StatusOr<BenchFigures> run_bench(const std::vector<std::unique_ptr<client::Client>>& connections,
                                       const BenchLoad& load, const std::function<void(uint64_t items)>& on_progress);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_BENCH_BENCH_LOAD_H_
