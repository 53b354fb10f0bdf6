// The cases of building: time for a tree from triangles by one thread, and the bytes that stay resident for each
// triangle.
#ifndef LOCUS_TESTS_BENCH_STATIC_BUILD_CASES_H_
#define LOCUS_TESTS_BENCH_STATIC_BUILD_CASES_H_

#include "tests/bench/static/mesh_run.h"

namespace locus::bench {

// Runs build and memory. Uses no peers of `run`: it makes its own builders and destroys them.
void run_build_cases(const MeshRun& run);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_BUILD_CASES_H_
