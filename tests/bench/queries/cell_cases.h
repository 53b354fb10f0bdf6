// Cases of the suite `queries` that query cells of free space with at most 32 planes, among objects or in a mesh. No
// library answers such queries; the peer is a test of all triangles or objects, for the first few points only.
#ifndef LOCUS_TESTS_BENCH_QUERIES_CELL_CASES_H_
#define LOCUS_TESTS_BENCH_QUERIES_CELL_CASES_H_

#include <string>
#include <vector>

#include "core/query/query_batch.h"
#include "core/scene/scene.h"
#include "tests/bench/frame/suite.h"
#include "tests/bench/static/bench_mesh.h"

namespace locus::bench::queries {

// Queries of cells of free space: one cell around each point (x, y, z), which ends at `distance` from the point.
struct CellWork {
  SnapshotPtr snapshot;
  Source source;
  std::vector<float> points;
  float distance;
};

// Measures one case, and checks the cells of the first points.
void run_cells(const Options& options, const std::string& name, const CellWork& work, Report& report);

// Runs the case on a mesh: cells around random points of its bounds.
void run_cell_cases(const Options& options, const Progress& progress, const BenchMesh& mesh, Report& report);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_CELL_CASES_H_
