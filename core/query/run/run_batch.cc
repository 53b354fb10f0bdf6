#include "core/query/run/run_batch.h"

#include <limits>
#include <memory>
#include <utility>

#include "core/base/status_macros.h"

namespace locus {

absl::StatusOr<BatchResult> run_batch(const SceneSnapshot& snapshot, const QueryBatch& batch,
                                      const RunOptions& options) {
  BatchResult result;
  result.blocks.resize(batch.blocks.size());
  BatchResultSink sink(result);
  const absl::StatusOr<std::unique_ptr<BatchRun>> run = BatchRun::prepare(snapshot, batch, options, sink);
  if (!run.ok()) return run.status();
  const auto work = [&run](size_t) {
    while ((*run)->work(std::numeric_limits<uint64_t>::max()) == Progress::kMore) {
    }
  };
  // A thread that finds no chunk to start may leave: the threads still working continue until the batch is done.
  if (options.parallel_for)
    options.parallel_for(BatchRun::kMaxChunks, work);
  else
    work(0);
  RETURN_IF_ERROR((*run)->status());
  for (size_t b = 0; b < result.blocks.size(); ++b) {
    result.blocks[b].work = (*run)->cost(b).work;
    result.blocks[b].nanoseconds = (*run)->cost(b).nanoseconds;
  }
  result.work = (*run)->cost().work;
  result.nanoseconds = (*run)->cost().nanoseconds;
  return result;
}

}  // namespace locus
