// A batch answered here and now, into columns of its own.
#ifndef LOCUS_CORE_QUERY_RUN_RUN_BATCH_H_
#define LOCUS_CORE_QUERY_RUN_RUN_BATCH_H_

#include "absl/status/statusor.h"
#include "core/query/query_batch.h"
#include "core/query/run/batch_result.h"
#include "core/query/run/batch_run.h"
#include "core/scene/snapshot/scene_snapshot.h"

namespace locus {

// `batch` has passed check_batch(). OUT_OF_RANGE for a time that is not kept, unless its block clamps.
absl::StatusOr<BatchResult> run_batch(const SceneSnapshot& snapshot, const QueryBatch& batch,
                                      const RunOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_RUN_BATCH_H_
