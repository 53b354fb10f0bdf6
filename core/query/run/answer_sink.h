// Where a batch's answer goes: columns that whoever asks owns, such as those of a reply, so that each number is written
// once, in its place. Columns nobody asked for are never touched.
//
// Threads: a sink is asked by one thread at a time, which need not be the same each time. What it hands out may be
// written by several at once, each its own rows.
#ifndef LOCUS_CORE_QUERY_RUN_ANSWER_SINK_H_
#define LOCUS_CORE_QUERY_RUN_ANSWER_SINK_H_

#include <cstddef>
#include <cstdint>

#include "core/query/columns.h"

namespace locus {

// When queries asked in fact, one entry a query.
struct TimeSpans {
  uint64_t* ticks;
  float* fractions;
};

class AnswerSink {
 public:
  virtual ~AnswerSink() = default;

  // Room for more rows at the end of the columns of a block. Where it is stays good until more rows of the block are
  // asked for. The rows hold anything until they are written, and all of them are, unless the batch ends with an error.
  virtual RowSpans add_rows(size_t block, ColumnSet columns, size_t rows) = 0;
  // The same for one byte a query, 0 or 1.
  virtual char* add_hits(size_t block, size_t queries) = 0;
  // Rows of each query.
  virtual uint32_t* add_counts(size_t block, size_t queries) = 0;
  // Numbers of queries that were cut, ascending.
  virtual uint32_t* add_truncated(size_t block, size_t queries) = 0;
  virtual TimeSpans add_times(size_t block, size_t queries) = 0;
  // Numbers of queries whose moment was not kept, so that the nearest was taken, ascending.
  virtual uint32_t* add_clamped(size_t block, size_t queries) = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_ANSWER_SINK_H_
