// The cases of rays: random and short ones, first hit and any hit, a picture, and several threads at once.
#ifndef LOCUS_TESTS_BENCH_STATIC_RAY_CASES_H_
#define LOCUS_TESTS_BENCH_STATIC_RAY_CASES_H_

#include "tests/bench/static/mesh_run.h"

namespace locus::bench {

// Returns whether the filter selects a case that has peers.
bool wants_ray_peers(const Options& options, const BenchMesh& mesh);

// Runs ray/incoherent/first, ray/incoherent/any, ray/short/first, ray/short/any, ray/camera/first.
void run_ray_cases(const MeshRun& run);

// Runs threads2, or as many as the options say, compared with one_thread, by wall time.
void run_threads_case(const MeshRun& run);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_RAY_CASES_H_
