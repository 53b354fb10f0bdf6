// Cases of the suite `serving` with rays in a real level. They compare rays that are sent over streams with the same
// batches in this process on the same cores, and one stream with two streams.
#ifndef LOCUS_TESTS_BENCH_SERVING_RAY_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_RAY_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

// Runs rays/90ns/1024, rays/90ns/8192, rays/270ns/1024, rays/270ns/8192, one_stream/1024, one_stream/8192. Each of the
// first four cases must reach a minimum ratio of the daemon's ray rate to the ray rate of direct library calls; this
// minimum is computed from the measured time of a ray in direct calls.
absl::Status run_ray_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_RAY_CASES_H_
