// A batch's answer in columns of its own, for whoever has no others to put it in. Plain data.
#ifndef LOCUS_CORE_QUERY_RUN_BATCH_RESULT_H_
#define LOCUS_CORE_QUERY_RUN_BATCH_RESULT_H_

#include <string>
#include <vector>

#include "core/index/work.h"
#include "core/query/run/answer_sink.h"

namespace locus {

template <class T>
using ColumnVector = std::vector<T>;

// Rows of one block, concatenated in query order; columns nobody asked for stay empty.
struct BlockResult : ColumnArrays<ColumnVector> {
  std::vector<uint32_t> counts;     // rows a query; empty = one row each
  std::vector<uint32_t> truncated;  // queries that were cut, ascending
  std::string hits;                 // ANY: one byte a query, 0 or 1
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

// More rows at the end of each column of `columns`.
RowSpans add_rows(BlockResult& result, ColumnSet columns, size_t rows);

class BatchResultSink final : public AnswerSink {
 public:
  // `result` is borrowed and has its blocks.
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
