// The cases `build` (time in which one thread builds a tree from triangles) and `memory` (bytes per triangle that stay
// resident after a build).
#ifndef LOCUS_TESTS_BENCH_STATIC_BUILD_CASES_H_
#define LOCUS_TESTS_BENCH_STATIC_BUILD_CASES_H_

#include "tests/bench/static/mesh_run.h"

namespace locus::bench {

// Runs build and memory. Makes builders of its own and destroys them; the peers in `run` are not used.
void run_build_cases(const MeshRun& run);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_BUILD_CASES_H_
