// Whether callers who do not read, or who come and go by the hundred, hurt another, and what they leave behind. For the
// suite serving.
#ifndef LOCUS_TESTS_BENCH_SERVING_GUEST_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_GUEST_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::serving {

bool wants_guests(const ServingRun& run);

// silent_reader/1, silent_reader/32, churn/1000 (in small fewer): p99 of another client, alone and beside them.
absl::Status run_guest_cases(const ServingRun& run, const BenchMesh& mesh);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_GUEST_CASES_H_
