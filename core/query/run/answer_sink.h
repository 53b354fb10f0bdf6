// Destination of a batch's result columns. The caller of a batch implements it, for example over the fields of a reply,
// so that each value is written once, at its final position. Columns that the batch did not request are never touched.
//
// Threads: one thread at a time calls a sink, but not always the same one. Several threads may write at once to the
// memory that a sink returned, each to its own rows.
#ifndef LOCUS_CORE_QUERY_RUN_ANSWER_SINK_H_
#define LOCUS_CORE_QUERY_RUN_ANSWER_SINK_H_

#include <cstddef>
#include <cstdint>

#include "core/query/columns.h"

namespace locus {

// Output arrays of the effective time of each query: its tick, and the fraction of the way to the next tick.
struct TimeSpans {
  uint64_t* ticks;
  float* fractions;
};

class AnswerSink {
 public:
  virtual ~AnswerSink() = default;

  // Appends `rows` uninitialized rows to each of the `columns` of block number `block`, and returns pointers to the
  // first of them. The pointers stay valid until more rows of the same block are added. The caller writes all rows
  // unless the batch ends with an error.
  virtual RowSpans add_rows(size_t block, ColumnSet columns, size_t rows) = 0;
  // Appends one byte per query, in which the caller writes 1 for a hit and 0 for a miss.
  virtual char* add_hits(size_t block, size_t queries) = 0;
  // Appends one entry per query, in which the caller writes the number of rows of the query.
  virtual uint32_t* add_counts(size_t block, size_t queries) = 0;
  // Appends entries in which the caller writes the indices of truncated queries, ascending.
  virtual uint32_t* add_truncated(size_t block, size_t queries) = 0;
  // Appends entries in which the caller writes the effective time of each query.
  virtual TimeSpans add_times(size_t block, size_t queries) = 0;
  // Appends entries in which the caller writes the indices, ascending, of queries that asked for a time outside the
  // history and got the nearest retained time.
  virtual uint32_t* add_clamped(size_t block, size_t queries) = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_ANSWER_SINK_H_
