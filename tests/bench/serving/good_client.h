// A well-behaved client: it sends one small batch after another over a stream of its own. Its latencies show the effect
// of other clients. Used by every case in which other clients run too. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_GOOD_CLIENT_H_
#define LOCUS_TESTS_BENCH_SERVING_GOOD_CLIENT_H_

#include <memory>
#include <string>
#include <vector>

#include "tests/bench/serving/query_load.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

class GoodClient {
 public:
  static constexpr size_t kRays = 16;  // rays per batch

  // Opens a stream, and computes in this process the expected answers to `batches`. ask() compares the server's answers
  // with them.
  GoodClient(const ServingRun& run, TwinScene& scene, const std::string& case_name, Batches batches);

  // Sends `count` batches and appends to `seconds` the time until each was answered.
  void ask(size_t count, std::vector<double>& seconds);

  const std::vector<uint64_t>& expected() const { return expected_; }
  const absl::Status& status() const { return status_; }

 private:
  const ServingRun& run_;
  const std::string case_name_;
  Batches batches_;
  const std::vector<uint64_t> expected_;
  const std::unique_ptr<QueryStreamLoad> stream_;
  absl::Status status_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_GOOD_CLIENT_H_
