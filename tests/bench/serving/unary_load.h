// Unary calls by a number of concurrent callers. Each caller sends its next call when its previous call is answered. A
// refused caller retries at once, like a flood, or waits for the retry hint, like the client library. All calls are
// asynchronous and use one connection. One thread.
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
  std::vector<double> refusals;                   // seconds until each refusal
  double client_seconds = 0, server_seconds = 0;  // processor time of this process and of the server
  absl::Status failure;                           // error of a call that is neither an answer nor a temporary refusal
};

// Sends calls for `seconds` seconds, then waits until every call has ended. The callers start one by one during the
// first twentieth of that time.
Flood run_unary_load(const Daemon& daemon, const Batches& batches, size_t callers, double seconds, Again again);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_UNARY_LOAD_H_
