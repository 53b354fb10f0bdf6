// Function that answers a batch synchronously, into columns that the result owns. The server uses BatchRun with the
// columns of its reply instead. Threads: any number of calls may run at the same time on one snapshot.
#ifndef LOCUS_TESTS_SUPPORT_RUN_BATCH_H_
#define LOCUS_TESTS_SUPPORT_RUN_BATCH_H_

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/index/work.h"
#include "core/query/run/answer_sink.h"
#include "core/query/run/batch_run.h"
#include "core/query/run/collected_rows.h"
#include "tests/support/threads.h"

namespace locus::test {

// Rows of one block, with the members of the protocol's BlockResult.
struct BlockResult : CollectedRows {
  std::string hits;    // mode ANY only: one byte per query, 0 or 1
  std::string matrix;  // sight only: one byte for each viewer and target
  // The next three members are set only for blocks with as_of_ticks. The first two are the effective time of each
  // query. If the time of a query was outside the history, the nearest recorded time was used, and `clamped` contains
  // the query's index. The indices ascend.
  std::vector<uint64_t> resolved_ticks;
  std::vector<float> resolved_fractions;
  std::vector<uint32_t> clamped;
  std::vector<uint32_t> unanchored;
  // Cost of the block. It may differ between equal results, because it depends on the index structures.
  Work work;
  uint64_t nanoseconds = 0;  // measured by RunOptions::work_clock, summed over all threads
};

struct BatchResult {
  std::vector<BlockResult> blocks;
  Work work;
  uint64_t nanoseconds = 0;
};

// Appends `entries` entries and returns a pointer to the first of them.
template <class Values>
auto* grow(Values& values, size_t entries) {
  values.resize(values.size() + entries);
  return values.data() + (values.size() - entries);
}

// Sink that appends to a BatchResult.
class BatchResultSink final : public AnswerSink {
 public:
  // `result` is borrowed; its `blocks` already have the number of blocks of the batch.
  explicit BatchResultSink(BatchResult& result) : result_(result) {}

  RowSpans add_rows(size_t block, ColumnSet columns, size_t rows) override {
    return locus::add_rows(result_.blocks.at(block), columns, rows);
  }
  char* add_hits(size_t block, size_t queries) override { return grow(result_.blocks.at(block).hits, queries); }
  char* add_matrix(size_t block, size_t bytes) override { return grow(result_.blocks.at(block).matrix, bytes); }
  uint32_t* add_counts(size_t block, size_t queries) override { return grow(result_.blocks.at(block).counts, queries); }
  uint32_t* add_truncated(size_t block, size_t queries) override {
    return grow(result_.blocks.at(block).truncated, queries);
  }
  TimeSpans add_times(size_t block, size_t queries) override {
    BlockResult& result = result_.blocks.at(block);
    return {grow(result.resolved_ticks, queries), grow(result.resolved_fractions, queries)};
  }
  uint32_t* add_clamped(size_t block, size_t queries) override {
    return grow(result_.blocks.at(block).clamped, queries);
  }
  uint32_t* add_unanchored(size_t block, size_t queries) override {
    return grow(result_.blocks.at(block).unanchored, queries);
  }

 private:
  BatchResult& result_;
};

// Answers `batch`, which has passed check_batch(), at `snapshot`. `parallel_for` distributes calls of BatchRun::work()
// over threads; if it is empty, this thread makes all calls. Returns OUT_OF_RANGE if a time is outside the history and
// the block's option `outside` is not kClamp. If RunOptions::stop ends the batch, returns the status of `stop`.
inline absl::StatusOr<BatchResult> run_batch(const SceneSnapshot& snapshot, const QueryBatch& batch,
                                             const RunOptions& options, const ParallelFor& parallel_for = {}) {
  BatchResult result;
  result.blocks.resize(batch.blocks.size());
  BatchResultSink sink(result);
  const absl::StatusOr<std::unique_ptr<BatchRun>> run = BatchRun::prepare(snapshot, batch, options, sink);
  if (!run.ok()) return run.status();
  const auto work = [&run](size_t) {
    while ((*run)->work(std::numeric_limits<uint64_t>::max()) == Progress::kMore) {
    }
  };
  // A thread that finds no chunk to start may return from work(): the other threads continue until the batch is
  // complete.
  if (parallel_for)
    parallel_for(BatchRun::kMaxChunks, work);
  else
    work(0);
  if (const absl::Status status = (*run)->status(); !status.ok()) return status;
  for (size_t b = 0; b < result.blocks.size(); ++b) {
    result.blocks[b].work = (*run)->cost(b).work;
    result.blocks[b].nanoseconds = (*run)->cost(b).nanoseconds;
  }
  result.work = (*run)->cost().work;
  result.nanoseconds = (*run)->cost().nanoseconds;
  return result;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RUN_BATCH_H_
