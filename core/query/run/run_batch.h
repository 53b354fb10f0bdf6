// Answers a batch synchronously, into columns that the result owns. For tests, tools and verification; the server uses
// BatchRun directly. Threads: any number of calls may run at once on one snapshot.
#ifndef LOCUS_CORE_QUERY_RUN_RUN_BATCH_H_
#define LOCUS_CORE_QUERY_RUN_RUN_BATCH_H_

#include "absl/status/statusor.h"
#include "core/query/query_batch.h"
#include "core/query/run/batch_result.h"
#include "core/query/run/batch_run.h"
#include "core/scene/snapshot/scene_snapshot.h"

namespace locus {

// Answers `batch`, which has passed check_batch(), at `snapshot`. Returns OUT_OF_RANGE for a time outside the history
// unless its block clamps, or the status of RunOptions::stop.
absl::StatusOr<BatchResult> run_batch(const SceneSnapshot& snapshot, const QueryBatch& batch,
                                      const RunOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_RUN_BATCH_H_
