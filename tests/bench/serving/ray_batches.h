// Rays of a level that the cases send, in messages. Pure functions.
#ifndef LOCUS_TESTS_BENCH_SERVING_RAY_BATCHES_H_
#define LOCUS_TESTS_BENCH_SERVING_RAY_BATCHES_H_

#include <string>
#include <vector>

#include "tests/bench/serving/query_load.h"
#include "tests/bench/serving/serving_run.h"
#include "tests/bench/static/bench_mesh.h"
#include "tests/bench/static/workload.h"

namespace locus::bench::serving {

// Returns the level named in the options, else a real one that was fetched; in a quick run, or if none was fetched, a
// generated one.
absl::StatusOr<BenchMesh> level_of(const ServingRun& run);

// Returns rays between random points of the level, or neighbouring rays of a picture of it.
std::vector<RayQuery> scattered_rays(const BenchMesh& mesh, size_t count);
std::vector<RayQuery> coherent_rays(const BenchMesh& mesh, size_t count);

// Makes messages of `size` rays; the last may have fewer.
Batches batches_of(const std::vector<RayQuery>& rays, size_t size, const std::string& scene);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_RAY_BATCHES_H_
