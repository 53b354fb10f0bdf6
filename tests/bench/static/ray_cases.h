// The cases of rays: random and short ones, first hit and any hit, a picture, and several threads at once.
#ifndef LOCUS_TESTS_BENCH_STATIC_RAY_CASES_H_
#define LOCUS_TESTS_BENCH_STATIC_RAY_CASES_H_

#include "tests/bench/static/mesh_run.h"

namespace locus::bench {

// Whether the filter wants one that asks peers, or asks us alone.
bool wants_ray_peers(const Options& options, const BenchMesh& mesh);

// ray/incoherent/first, ray/incoherent/any, ray/short/first, ray/short/any, ray/camera/first.
void run_ray_cases(const MeshRun& run);

// threads2, or as many as were asked for: beside one_thread, by the clock on the wall.
void run_threads_case(const MeshRun& run);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_RAY_CASES_H_
