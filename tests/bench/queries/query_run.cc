#include "tests/bench/queries/query_run.h"

#include <utility>

#include "core/base/check.h"
#include "core/base/limits.h"

namespace locus::bench::queries {

SnapshotPtr scene_of(const BenchMesh& mesh) {
  test::PlacedMesh placed;
  placed.id = 1;
  placed.mesh = test::mesh_of(mesh.triangles);
  test::QueryWorld world;
  world.instances = {placed};
  return test::snapshot_of(world);
}

test::BlockResult answer_of(const SceneSnapshot& snapshot, QueryBlock block, bool brute_force) {
  QueryBatch batch;
  batch.max_reply_bytes = limits::kMaxReplyBytes;
  batch.blocks.push_back(std::move(block));
  LOCUS_CHECK(check_batch(batch).ok());
  RunOptions options;
  options.brute_force = brute_force;
  absl::StatusOr<test::BatchResult> result = test::run_batch(snapshot, batch, options);
  LOCUS_CHECK(result.ok());
  return std::move(result->blocks[0]);
}

Cell cell_of(const std::string& name, const char* metric, const ResultsHash& hash) {
  Cell cell;
  cell.suite = "queries";
  cell.case_name = name;
  cell.metric = metric;
  cell.results_hash = hash.text();
  return cell;
}

}  // namespace locus::bench::queries
