// The cases of building: a tree from triangles by one thread, and what stays resident for each triangle.
#ifndef LOCUS_TESTS_BENCH_STATIC_BUILD_CASES_H_
#define LOCUS_TESTS_BENCH_STATIC_BUILD_CASES_H_

#include "tests/bench/static/mesh_run.h"

namespace locus::bench {

// build and memory. Asks no peers of `run`: it makes its own and lets go of them.
void run_build_cases(const MeshRun& run);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_BUILD_CASES_H_
