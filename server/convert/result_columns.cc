#include "server/convert/result_columns.h"

namespace locus::server {
namespace {

// Appends `entries` entries to the column and returns a pointer to the first. The caller must write all of them.
template <class T>
T* grow(google::protobuf::RepeatedField<T>& column, size_t entries) {
  const int before = column.size();
  column.Reserve(before + static_cast<int>(entries));
  column.AddNAlreadyReserved(static_cast<int>(entries));
  return column.mutable_data() + before;
}

}  // namespace

ResultColumns::ResultColumns(v1::QueryResult& result, size_t blocks) : result_(result) {
  // Protobuf keeps the memory of cleared blocks, and add_blocks() reuses it.
  result.clear_blocks();
  for (size_t i = 0; i < blocks; ++i) result.add_blocks();
}

RowSpans ResultColumns::add_rows(size_t number, ColumnSet columns, size_t rows) {
  v1::BlockResult& to = block(number);
  RowSpans spans;
#define LOCUS_ADD_ROWS(column, name, type, array, width) \
  if (columns.has(Column::column)) spans.array = grow(*to.mutable_##array(), (width)*rows);
  LOCUS_COLUMN_ARRAYS(LOCUS_ADD_ROWS)
#undef LOCUS_ADD_ROWS
  return spans;
}

char* ResultColumns::add_hits(size_t number, size_t queries) {
  std::string& hits = *block(number).mutable_hits();
  hits.resize(hits.size() + queries);
  return hits.data() + (hits.size() - queries);
}

char* ResultColumns::add_matrix(size_t number, size_t bytes) {
  std::string& matrix = *block(number).mutable_sight();
  matrix.resize(matrix.size() + bytes);
  return matrix.data() + (matrix.size() - bytes);
}

uint32_t* ResultColumns::add_counts(size_t number, size_t queries) {
  return grow(*block(number).mutable_counts(), queries);
}

uint32_t* ResultColumns::add_truncated(size_t number, size_t queries) {
  return grow(*block(number).mutable_truncated(), queries);
}

TimeSpans ResultColumns::add_times(size_t number, size_t queries) {
  v1::BlockResult& to = block(number);
  return {grow(*to.mutable_resolved_ticks(), queries), grow(*to.mutable_resolved_fractions(), queries)};
}

uint32_t* ResultColumns::add_clamped(size_t number, size_t queries) {
  return grow(*block(number).mutable_clamped(), queries);
}

uint32_t* ResultColumns::add_unanchored(size_t number, size_t queries) {
  return grow(*block(number).mutable_unanchored(), queries);
}

}  // namespace locus::server
