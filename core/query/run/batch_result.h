// Result of a batch in vectors that it owns, for callers without columns of their own: run_batch() and tests. Plain
// data; BatchResultSink fills it, and its thread promise is that of AnswerSink.
#ifndef LOCUS_CORE_QUERY_RUN_BATCH_RESULT_H_
#define LOCUS_CORE_QUERY_RUN_BATCH_RESULT_H_

#include <string>
#include <vector>

#include "core/index/work.h"
#include "core/query/run/answer_sink.h"

namespace locus {

template <class T>
using ColumnVector = std::vector<T>;

// Rows of one block, concatenated in query order; columns that were not requested stay empty.
struct BlockResult : ColumnArrays<ColumnVector> {
  std::vector<uint32_t> counts;     // rows per query; empty for dense results, which have one row each
  std::vector<uint32_t> truncated;  // indices of truncated queries, ascending
  std::string hits;                 // ANY: one byte per query, 0 or 1
  // Blocks with as_of_ticks: the effective time of each query, and the indices, ascending, of queries that asked for a
  // time outside the history and got the nearest kept time.
  std::vector<uint64_t> resolved_ticks;
  std::vector<float> resolved_fractions;
  std::vector<uint32_t> clamped;
  // Cost, which may differ between equal results: work depends on the index structures.
  Work work;
  uint64_t nanoseconds = 0;  // by RunOptions::work_clock, all threads together
};

struct BatchResult {
  std::vector<BlockResult> blocks;
  Work work;
  uint64_t nanoseconds = 0;
};

// Appends `rows` uninitialized rows to each column of `columns`; the pointers stay valid until the next call.
RowSpans add_rows(BlockResult& result, ColumnSet columns, size_t rows);

// Sink that appends to a BatchResult.
class BatchResultSink final : public AnswerSink {
 public:
  // `result` is borrowed; its `blocks` already have the number of blocks of the batch.
  explicit BatchResultSink(BatchResult& result) : result_(result) {}

  RowSpans add_rows(size_t block, ColumnSet columns, size_t rows) override;
  char* add_hits(size_t block, size_t queries) override;
  uint32_t* add_counts(size_t block, size_t queries) override;
  uint32_t* add_truncated(size_t block, size_t queries) override;
  TimeSpans add_times(size_t block, size_t queries) override;
  uint32_t* add_clamped(size_t block, size_t queries) override;

 private:
  BatchResult& result_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_BATCH_RESULT_H_
