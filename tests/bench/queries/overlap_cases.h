// Cases of the suite `queries` that compare two ways of finding overlaps with one mesh. One case compares a query of
// capsules with a query of balls around the capsules and a test of each triangle found. Another case compares a query
// that returns rows with a query that only counts rows.
#ifndef LOCUS_TESTS_BENCH_QUERIES_OVERLAP_CASES_H_
#define LOCUS_TESTS_BENCH_QUERIES_OVERLAP_CASES_H_

#include "tests/bench/frame/suite.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::queries {

void run_overlap_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_OVERLAP_CASES_H_
