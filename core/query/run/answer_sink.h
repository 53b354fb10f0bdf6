// Interface to the memory of a batch's result columns. The caller that runs a batch implements this interface, for
// example over the fields of a reply, so that each value is written once, at its final position. The batch never writes
// columns that it does not return.
//
// Threads: one thread at a time calls a sink, but not always the same thread. Several threads may write at the same
// time to memory that a sink has returned, each to its own rows.
#ifndef LOCUS_CORE_QUERY_RUN_ANSWER_SINK_H_
#define LOCUS_CORE_QUERY_RUN_ANSWER_SINK_H_

#include <cstddef>
#include <cstdint>

#include "core/query/columns.h"

namespace locus {

// Output arrays for the effective times of queries: the tick, and the fraction of the way to the next tick.
struct TimeSpans {
  uint64_t* ticks;
  float* fractions;
};

class AnswerSink {
 public:
  virtual ~AnswerSink() = default;

  // Appends `rows` uninitialized rows to each of the `columns` of block number `block`, and returns pointers to the
  // first new row. The pointers stay valid until more rows of the same block are added. The caller writes all rows
  // unless the batch ends with an error.
  virtual RowSpans add_rows(size_t block, ColumnSet columns, size_t rows) = 0;
  // Appends one byte for each query of the block. The caller writes 1 for a hit and 0 for a miss.
  virtual char* add_hits(size_t block, size_t queries) = 0;
  // Appends `bytes` bytes to the matrix of the block. The caller writes bytes_per_query() bytes for each query.
  virtual char* add_matrix(size_t block, size_t bytes) = 0;
  // Appends `queries` entries to the row counts of the block. The caller writes the number of rows of each query.
  virtual uint32_t* add_counts(size_t block, size_t queries) = 0;
  // Appends `queries` entries to the list of truncated queries of the block. The caller writes the indices that these
  // queries have in the block, ascending.
  virtual uint32_t* add_truncated(size_t block, size_t queries) = 0;
  // Appends `queries` entries to the effective times of the block. The caller writes the time at which each query is
  // evaluated.
  virtual TimeSpans add_times(size_t block, size_t queries) = 0;
  // Appends `queries` entries to the list of clamped queries of the block: queries that requested a time outside the
  // history and are answered at the nearest retained time. The caller writes the indices that these queries have in the
  // block, ascending.
  virtual uint32_t* add_clamped(size_t block, size_t queries) = 0;
  // Appends `queries` entries to the block's list of unanchored queries (QueryOrigins::is_unanchored()). The caller
  // writes the indices that these queries have in the block, ascending.
  virtual uint32_t* add_unanchored(size_t block, size_t queries) = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_ANSWER_SINK_H_
