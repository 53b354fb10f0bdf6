// Single calls, so many callers at once, each of whom sends its next one when the one before is answered. One who is
// refused tries again at once, as a flood does, or waits as it is told, as the client library does. Asynchronous, over
// a connection of its own. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_UNARY_LOAD_H_
#define LOCUS_TESTS_BENCH_SERVING_UNARY_LOAD_H_

#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "tests/bench/serving/daemon.h"
#include "tests/bench/serving/query_load.h"

namespace locus::bench::serving {

enum class Again : uint8_t { kAtOnce, kAsTold };

struct Flood {
  size_t answered = 0;
  std::vector<double> refusals;                   // seconds that each took
  double client_seconds = 0, server_seconds = 0;  // of processor time
  absl::Status failure;                           // of a call that was neither answered nor refused for the time being
};

// For `seconds`, during the first twentieth of which the callers come, then until every call is over.
Flood run_unary_load(const Daemon& daemon, const Batches& batches, size_t callers, double seconds, Again again);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_UNARY_LOAD_H_
