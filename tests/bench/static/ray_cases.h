// The cases of rays: first hit and any hit of random rays and of short rays, first hits of a picture, and several
// threads at once.
#ifndef LOCUS_TESTS_BENCH_STATIC_RAY_CASES_H_
#define LOCUS_TESTS_BENCH_STATIC_RAY_CASES_H_

#include "tests/bench/static/mesh_run.h"

namespace locus::bench {

// Returns whether the filter selects at least one ray case in which other libraries are measured too.
bool wants_ray_peers(const Options& options, const BenchMesh& mesh);

// Runs ray/incoherent/first, ray/incoherent/any, ray/short/first, ray/short/any, ray/camera/first.
void run_ray_cases(const MeshRun& run);

// Runs the case threads2, with the number of threads in the options, compared with one_thread, by wall time.
void run_threads_case(const MeshRun& run);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_RAY_CASES_H_
