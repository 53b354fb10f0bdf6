// Cases of the suite `queries` that ask for cells of free space, 32 planes at most, on objects or on a mesh. No library
// answers such queries; the peer is a test of all values, with a part of the points.
#ifndef LOCUS_TESTS_BENCH_QUERIES_CELL_CASES_H_
#define LOCUS_TESTS_BENCH_QUERIES_CELL_CASES_H_

#include <string>
#include <vector>

#include "core/query/query_batch.h"
#include "core/scene/scene.h"
#include "tests/bench/frame/suite.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::queries {

// Cells around points, x y z each, that end at a distance.
struct CellWork {
  SnapshotPtr snapshot;
  Source source;
  std::vector<float> points;
  float distance;
};

// Measures one case, and checks the cells of the first points.
void run_cells(const Options& options, const std::string& name, const CellWork& work, Report& report);

// Runs the case on a mesh: random points of its bounds.
void run_cell_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_CELL_CASES_H_
