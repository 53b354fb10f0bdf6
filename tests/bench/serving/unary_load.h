// Single calls, so many under way, each answered or refused one followed by the next: a closed loop that does not wait
// when it is told to, as a flood does not. Asynchronous, over a connection of its own. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_UNARY_LOAD_H_
#define LOCUS_TESTS_BENCH_SERVING_UNARY_LOAD_H_

#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "tests/bench/serving/daemon.h"
#include "tests/bench/serving/query_load.h"

namespace locus::bench::serving {

struct Flood {
  size_t answered = 0;
  std::vector<double> refusals;  // seconds that each took
  absl::Status failure;          // of a call that was neither answered nor refused for the time being
};

// For `seconds`, then until every call is over.
Flood run_unary_load(const Daemon& daemon, const Batches& batches, size_t under_way, double seconds);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_UNARY_LOAD_H_
