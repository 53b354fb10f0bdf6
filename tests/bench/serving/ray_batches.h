// Rays in a level, messages of rays, and the comparison of their answers. Used by the cases that send rays. Functions
// without state.
#ifndef LOCUS_TESTS_BENCH_SERVING_RAY_BATCHES_H_
#define LOCUS_TESTS_BENCH_SERVING_RAY_BATCHES_H_

#include <string>
#include <vector>

#include "tests/bench/serving/query_load.h"
#include "tests/bench/serving/serving_run.h"
#include "tests/bench/static/bench_mesh.h"
#include "tests/bench/static/workload.h"

namespace locus::bench::serving {

// Returns the first mesh named in the options. If none is named, returns a real level that was fetched; in a quick run,
// or if it was not fetched, a generated level.
absl::StatusOr<BenchMesh> level_of(const ServingRun& run);

// Return rays of the level: scattered_rays() from random points in random directions, coherent_rays() neighbouring rays
// of a picture.
std::vector<RayQuery> scattered_rays(const BenchMesh& mesh, size_t count);
std::vector<RayQuery> coherent_rays(const BenchMesh& mesh, size_t count);

// Makes messages of `size` rays each; the last message may have fewer.
Batches batches_of(const std::vector<RayQuery>& rays, size_t size, const std::string& scene);

// Reports a disagreement if the hashes of the answers of a server differ from those of this process.
void check_answers(const ServingRun& run, const std::string& case_name, const std::vector<uint64_t>& theirs,
                   const std::vector<uint64_t>& ours);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_RAY_BATCHES_H_
