// The rays that the cases send: of a level, in messages. Pure functions.
#ifndef LOCUS_TESTS_BENCH_SERVING_RAY_BATCHES_H_
#define LOCUS_TESTS_BENCH_SERVING_RAY_BATCHES_H_

#include <string>
#include <vector>

#include "tests/bench/serving/query_load.h"
#include "tests/bench/serving/serving_run.h"
#include "tests/bench/static/bench_mesh.h"
#include "tests/bench/static/workload.h"

namespace locus::bench::serving {

// The one that was asked for, or a real one that has been fetched, or, in small and where there is none, a made-up one.
absl::StatusOr<BenchMesh> level_of(const ServingRun& run);

// From anywhere in the level to anywhere; neighbours in a picture of it.
std::vector<RayQuery> scattered_rays(const BenchMesh& mesh, size_t count);
std::vector<RayQuery> coherent_rays(const BenchMesh& mesh, size_t count);

// `size` rays a message; the last may have fewer.
Batches batches_of(const std::vector<RayQuery>& rays, size_t size, const std::string& scene);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_RAY_BATCHES_H_
