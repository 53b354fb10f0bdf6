// Moves and balls over one connection, in a flat world, compared with GEOADD and GEOSEARCH of Redis. Used by the
// benchmark suite `serving`.
#ifndef LOCUS_TESTS_BENCH_SERVING_REDIS_CASES_H_
#define LOCUS_TESTS_BENCH_SERVING_REDIS_CASES_H_

#include "absl/status/status.h"
#include "tests/bench/serving/serving_run.h"

namespace locus::bench::serving {

// Runs moves/100k, ball/10k, ball/100k, ball/1M; in a quick run moves/10k and ball/10k. If Redis is not installed, adds
// a note instead.
absl::Status run_redis_cases(const ServingRun& run);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_REDIS_CASES_H_
