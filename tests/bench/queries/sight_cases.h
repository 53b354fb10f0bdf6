// Cases of the suite `queries` in which viewers look for targets through one mesh; one case adds objects, and one adds
// copies of the mesh. Most cases query a matrix of 100 viewers x 100 targets. Each target has three sample points.
// Every case is compared with the same segments as rays of mode ANY in one batch.
#ifndef LOCUS_TESTS_BENCH_QUERIES_SIGHT_CASES_H_
#define LOCUS_TESTS_BENCH_QUERIES_SIGHT_CASES_H_

#include "tests/bench/frame/suite.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::queries {

// Adds the cells of the cases that the filter wants. If the answer of a sight query differs from the answers to the
// same segments as rays, adds a disagreement to the report.
void run_sight_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_SIGHT_CASES_H_
