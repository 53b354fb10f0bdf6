// Rows of one chunk of a batch, stored until all earlier chunks are written out: one vector per column array, the row
// counts, and the indices of truncated queries. Plain data.
#ifndef LOCUS_CORE_QUERY_RUN_COLLECTED_ROWS_H_
#define LOCUS_CORE_QUERY_RUN_COLLECTED_ROWS_H_

#include <vector>

#include "core/query/columns.h"

namespace locus {

template <class T>
using ColumnVector = std::vector<T>;

// Rows of some queries of one block, concatenated in query order; columns that the block does not return stay empty.
struct CollectedRows : ColumnArrays<ColumnVector> {
  std::vector<uint32_t> counts;     // number of rows of each query of a kCounted block; otherwise empty
  std::vector<uint32_t> truncated;  // indices of truncated queries in the block, ascending
};

// Appends `rows` rows of zeros to each column of `columns`, and returns pointers to the first new row. The pointers
// stay valid until the next call for the same `collected`.
inline RowSpans add_rows(CollectedRows& collected, ColumnSet columns, size_t rows) {
  RowSpans spans;
  for_each_column_array([&](const auto& array) {
    if (!columns.has(array.column)) return;
    auto& values = array.get(collected);
    values.resize(values.size() + array.width * rows);
    array.get(spans) = values.data() + (values.size() - array.width * rows);
  });
  return spans;
}

// Returns pointers to the first of the last `rows` rows in each column of `columns`. The pointers stay valid until the
// next call of add_rows() for the same `collected`.
inline RowSpans last_rows(CollectedRows& collected, ColumnSet columns, size_t rows) {
  RowSpans spans;
  for_each_column_array([&](const auto& array) {
    auto& values = array.get(collected);
    if (columns.has(array.column)) array.get(spans) = values.data() + (values.size() - array.width * rows);
  });
  return spans;
}

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_COLLECTED_ROWS_H_
