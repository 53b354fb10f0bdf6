#include "core/query/run/batch_result.h"

#include "core/base/check.h"

namespace locus {
namespace {

template <class Values>
auto* grow(Values& values, size_t entries) {
  values.resize(values.size() + entries);
  return values.data() + (values.size() - entries);
}

}  // namespace

RowSpans add_rows(BlockResult& result, ColumnSet columns, size_t rows) {
  RowSpans spans;
  for_each_column_array([&](const auto& array) {
    if (columns.has(array.column)) array.get(spans) = grow(array.get(result), array.width * rows);
  });
  return spans;
}

RowSpans BatchResultSink::add_rows(size_t block, ColumnSet columns, size_t rows) {
  LOCUS_DCHECK_LT(block, result_.blocks.size());
  return locus::add_rows(result_.blocks[block], columns, rows);
}
char* BatchResultSink::add_hits(size_t block, size_t queries) { return grow(result_.blocks[block].hits, queries); }
uint32_t* BatchResultSink::add_counts(size_t block, size_t queries) {
  LOCUS_DCHECK_LT(block, result_.blocks.size());
  return grow(result_.blocks[block].counts, queries);
}
uint32_t* BatchResultSink::add_truncated(size_t block, size_t queries) {
  return grow(result_.blocks[block].truncated, queries);
}
TimeSpans BatchResultSink::add_times(size_t block, size_t queries) {
  BlockResult& result = result_.blocks[block];
  return {grow(result.resolved_ticks, queries), grow(result.resolved_fractions, queries)};
}
uint32_t* BatchResultSink::add_clamped(size_t block, size_t queries) {
  return grow(result_.blocks[block].clamped, queries);
}

}  // namespace locus
