// Common parts of the cases of the suite `queries`: the scene of one mesh, the answer to one block of queries, and the
// cell of a report. Functions without state.
#ifndef LOCUS_TESTS_BENCH_QUERIES_QUERY_RUN_H_
#define LOCUS_TESTS_BENCH_QUERIES_QUERY_RUN_H_

#include <string>

#include "tests/bench/frame/cell.h"
#include "tests/bench/frame/results_hash.h"
#include "tests/bench/static/bench_mesh.h"
#include "tests/support/query_world.h"
#include "tests/support/run_batch.h"

namespace locus::bench::queries {

// Returns a scene whose only content is the mesh, placed as instance 1 without rotation.
SnapshotPtr scene_of(const BenchMesh& mesh);

// Answers a batch of one block as the server does. With `brute_force`, tests all objects and triangles instead of
// searching the indexes. The batch must be valid.
test::BlockResult answer_of(const SceneSnapshot& snapshot, QueryBlock block, bool brute_force = false);

// Returns a cell of the suite for the results with this hash. `metric` is, for example, "ns/sweep".
Cell cell_of(const std::string& name, const char* metric, const ResultsHash& hash);

}  // namespace locus::bench::queries

#endif  // LOCUS_TESTS_BENCH_QUERIES_QUERY_RUN_H_
