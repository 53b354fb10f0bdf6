// Cases of the suite `queries` that compare two ways of asking for overlaps with one mesh: capsules, or balls around
// them and a test of what these touch; and rows, or their number.
#ifndef LOCUS_TESTS_BENCH_QUERIES_OVERLAP_CASES_H_
#define LOCUS_TESTS_BENCH_QUERIES_OVERLAP_CASES_H_

#include "tests/bench/frame/suite.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::queries {

void run_overlap_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_OVERLAP_CASES_H_
