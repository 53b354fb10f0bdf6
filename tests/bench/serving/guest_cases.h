// Effects of clients that do not read, or that connect and leave by the hundred, on another client, and the resources
// that stay occupied after them. For the suite serving.
#ifndef LOCUS_TESTS_BENCH_SERVING_GUEST_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_GUEST_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::serving {

bool wants_guests(const ServingRun& run);

// Runs silent_reader/1, silent_reader/32, churn/1000 (fewer in a quick run): p99 of another client, alone and beside
// them.
absl::Status run_guest_cases(const ServingRun& run, const BenchMesh& mesh);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_GUEST_CASES_H_
