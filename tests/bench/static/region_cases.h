// The cases that find the numbers of all triangles: on random rays, and in balls and boxes of 0.5, 2 and 10 % of the
// mesh's diagonal.
#ifndef LOCUS_TESTS_BENCH_STATIC_REGION_CASES_H_
#define LOCUS_TESTS_BENCH_STATIC_REGION_CASES_H_

#include "tests/bench/static/mesh_run.h"

namespace locus::bench {

// Returns whether the filter selects one of these cases.
bool wants_region_peers(const Options& options, const BenchMesh& mesh);

// Runs ray/incoherent/all, ball/0.5, ball/2, ball/10, box/0.5, box/2, box/10.
void run_region_cases(const MeshRun& run);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_REGION_CASES_H_
