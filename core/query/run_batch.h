// Answers a checked batch against one snapshot. The answer is a function of snapshot and batch alone: how the queries
// are split over threads changes no byte of it (a batch cut by max_work apart).
#ifndef LOCUS_CORE_QUERY_RUN_BATCH_H_
#define LOCUS_CORE_QUERY_RUN_BATCH_H_

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/index/work.h"
#include "core/query/query_batch.h"
#include "core/scene/scene_snapshot.h"

namespace locus {

// Rows of one block, concatenated in query order; columns nobody asked for stay empty.
struct BlockResult {
  std::vector<uint32_t> counts;     // rows a query; empty = one row each
  std::vector<uint32_t> truncated;  // queries that were cut, ascending
  std::string hits;                 // ANY: one byte a query, 0 or 1
  std::vector<float> t;
  std::vector<uint64_t> ids;
  std::vector<uint32_t> triangles;
  std::vector<float> uvs;      // 2 a row
  std::vector<float> normals;  // 3 a row
  std::vector<float> points;   // 3 a row, relative to the block's frame
  std::vector<uint64_t> groups;
  std::vector<uint64_t> tags;
  std::vector<uint32_t> layers;
  std::vector<double> positions;  // POSE: 3 a row
  std::vector<float> rotations;   // POSE: 4 a row
  // Blocks that ask about the past: the moments that were asked in fact, one a query, and the queries, ascending, whose
  // moment was not kept, so that the nearest was taken.
  std::vector<uint64_t> resolved_ticks;
  std::vector<float> resolved_fractions;
  std::vector<uint32_t> clamped;
  Work work;                 // not part of the answer: depends on the structure
  uint64_t nanoseconds = 0;  // nor is this: by RunOptions::clock, all threads together
};

struct BatchResult {
  std::vector<BlockResult> blocks;
  Work work;
  uint64_t nanoseconds = 0;
};

struct RunOptions {
  // Calls its second argument for each number below the first, on any threads, and returns when all calls have. [in
  // order, on this thread]
  std::function<void(size_t, const std::function<void(size_t)>&)> parallel_for;
  // Asked every limits::kTestsBetweenChecks primitive tests, from any thread: a status that is not OK ends the batch
  // with it. [never ends]
  std::function<absl::Status()> stop;
  // Nanoseconds since some moment, asked before and after each piece of work, from any thread. [times are 0]
  std::function<uint64_t()> clock;
  // Test every value instead of asking the structures: for checking them. Same answers, different work.
  bool brute_force = false;
};

// `batch` has passed check_batch(). OUT_OF_RANGE for a time that is not kept, unless its block clamps.
absl::StatusOr<BatchResult> run_batch(const SceneSnapshot& snapshot, const QueryBatch& batch,
                                      const RunOptions& options);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_BATCH_H_
