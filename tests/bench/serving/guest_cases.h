// Measures how a client is affected by other clients: by some that do not read, and by hundreds that connect and leave.
// Also measures which of the server's resources stay occupied after these other clients have left. Used by the
// benchmark suite `serving`.
#ifndef LOCUS_TESTS_BENCH_SERVING_GUEST_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_GUEST_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::serving {

bool wants_guests(const ServingRun& run);

// Runs silent_reader/1, silent_reader/32, churn/1000 (fewer in a quick run): the 99th percentile of the good client's
// waiting times, alone and while these clients run.
absl::Status run_guest_cases(const ServingRun& run, const BenchMesh& mesh);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_GUEST_CASES_H_
