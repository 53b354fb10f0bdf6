// Unary calls by a number of concurrent callers, each of which sends its next one when the one before is answered. A
// refused caller retries at once, like a flood, or waits for the retry hint, like the client library. Asynchronous,
// over a connection of its own. One thread.
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
  std::vector<double> refusals;                   // seconds of each
  double client_seconds = 0, server_seconds = 0;  // processor time
  absl::Status failure;                           // error of a call that is neither an answer nor a temporary refusal
};

// Runs for `seconds`, during the first twentieth of which the callers start, then until every call has ended.
Flood run_unary_load(const Daemon& daemon, const Batches& batches, size_t callers, double seconds, Again again);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_UNARY_LOAD_H_
