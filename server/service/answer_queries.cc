#include "server/service/answer_queries.h"

#include <chrono>

#include "server/service/convert.h"

namespace locus::server {
namespace {

uint64_t nanoseconds_now() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(since).count());
}

absl::StatusOr<QueryBatch> read_batch(const v1::QueryBatch& batch) {
  absl::StatusOr<QueryBatch> queries = to_queries(batch);
  if (!queries.ok()) return queries;
  if (absl::Status status = check_batch(*queries); !status.ok()) return status;
  return queries;
}

void write_result(const SceneSnapshot& snapshot, const BatchResult& answer, v1::QueryResult* result) {
  result->set_epoch(snapshot.epoch);
  result->set_revision(snapshot.revision);
  result->set_tick(snapshot.tick);
  for (const BlockResult& block : answer.blocks) to_proto(block, result->add_blocks());
}

void write_work(const BatchResult& answer, v1::QueryResult* result) {
  *result->mutable_work() = to_proto(answer.work, answer.nanoseconds);
  for (size_t i = 0; i < answer.blocks.size(); ++i)
    *result->mutable_blocks(static_cast<int>(i))->mutable_work() =
        to_proto(answer.blocks[i].work, answer.blocks[i].nanoseconds);
}

RunOptions run_options(Host& host, const Caller& caller, const SnapshotPin& pin, bool explain) {
  RunOptions options;
  options.parallel_for = [&host](size_t n, const std::function<void(size_t)>& fn) { host.pool.parallel_for(n, fn); };
  options.stop = [&caller, &pin] {
    absl::Status told = pin.status();
    return told.ok() ? caller.stop() : told;
  };
  if (explain) options.clock = &nanoseconds_now;
  return options;
}

}  // namespace

absl::Status answer_queries(Host& host, const Caller& caller, const std::string& scene_name,
                            const v1::QueryBatch& batch, SteadyTime wait_until, v1::QueryResult* result) {
  const absl::StatusOr<ScenePtr> scene = find_scene(caller, scene_name, "scene");
  if (!scene.ok()) return scene.status();
  const absl::StatusOr<QueryBatch> queries = read_batch(batch);
  if (!queries.ok()) return queries.status();
  const absl::StatusOr<SnapshotPin> snapshot = wait_for(**scene, to_view(batch.view()), wait_until, caller);
  if (!snapshot.ok()) return snapshot.status();
  const absl::StatusOr<BatchResult> answer =
      run_batch(**snapshot, *queries, run_options(host, caller, *snapshot, batch.explain()));
  if (!answer.ok()) return answer.status();
  write_result(**snapshot, *answer, result);
  if (batch.explain()) write_work(*answer, result);
  return absl::OkStatus();
}

}  // namespace locus::server
