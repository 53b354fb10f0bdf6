// Table of the result columns of a block: their names, element types and widths. Also defines which columns each kind
// of query can return, and computes their size in a reply.
//
// To add a column: add a value to Column (query_batch.h), a row to LOCUS_COLUMN_ARRAYS, and the column to the kinds
// that return it (ServedColumns in columns.cc), and write its values in run/rows.cc. All code of the server that
// allocates, copies, measures or sends columns is generated from LOCUS_COLUMN_ARRAYS. Each client lists the columns
// that it shows; a test of the client fails if the protocol has a column that the client does not know.
#ifndef LOCUS_CORE_QUERY_COLUMNS_H_
#define LOCUS_CORE_QUERY_COLUMNS_H_

#include <cstdint>

#include "absl/strings/string_view.h"
#include "core/query/query_batch.h"

namespace locus {

// Table of the arrays of the result columns. Each row has the column, the column's name in the protocol without the
// prefix "COLUMN_", the type and the name of the array, and the number of values per result row. The field of the
// protocol's BlockResult has the same name as the array.
#define LOCUS_COLUMN_ARRAYS(X)                     \
  X(kT, "T", float, t, 1)                          \
  X(kId, "ID", uint64_t, ids, 1)                   \
  X(kTriangle, "TRIANGLE", uint32_t, triangles, 1) \
  X(kUv, "UV", float, uvs, 2)                      \
  X(kNormal, "NORMAL", float, normals, 3)          \
  X(kPoint, "POINT", float, points, 3)             \
  X(kGroup, "GROUP", uint64_t, groups, 1)          \
  X(kTag, "TAG", uint64_t, tags, 1)                \
  X(kLayers, "LAYERS", uint32_t, layers, 1)        \
  X(kPose, "POSE", double, positions, 3)           \
  X(kPose, "POSE", float, rotations, 4)            \
  X(kOther, "OTHER", uint64_t, others, 1)          \
  X(kShape, "SHAPE", uint32_t, shapes, 1)          \
  X(kShape, "SHAPE", float, sizes, 4)

// Arrays of the result columns. Array<T> is a std::vector<T> in CollectedRows, which owns rows, and a T* in RowSpans,
// which points to rows in a reply or in CollectedRows. Points are relative to the block's frame.
template <template <class> class Array>
struct ColumnArrays {
// NOLINTNEXTLINE(bugprone-macro-parentheses): `array` is the name of a member
#define LOCUS_ARRAY(column, name, type, array, width) Array<type> array{};
  LOCUS_COLUMN_ARRAYS(LOCUS_ARRAY)
#undef LOCUS_ARRAY
};

// Description of an array: the result column `column` stores `width` values for each result row in the array that
// get() returns.
template <class Get>
struct ColumnArray {
  Column column;
  uint32_t width;
  Get get;
};
template <class Get>
ColumnArray(Column, uint32_t, Get) -> ColumnArray<Get>;

// Calls visit() with a ColumnArray for each array, in the order of the table.
template <class Visit>
constexpr void for_each_column_array(const Visit& visit) {
#define LOCUS_VISIT(column, name, type, array, width) \
  visit(ColumnArray{Column::column, width, [](auto& arrays) -> decltype(auto) { return (arrays.array); }});
  LOCUS_COLUMN_ARRAYS(LOCUS_VISIT)
#undef LOCUS_VISIT
}

// Returns the column's name in the protocol without the prefix "COLUMN_".
constexpr absl::string_view column_name(Column wanted) {
#define LOCUS_NAME(column, name, type, array, width) \
  if (wanted == Column::column) return name;
  LOCUS_COLUMN_ARRAYS(LOCUS_NAME)
#undef LOCUS_NAME
  return "UNSPECIFIED";
}

// Destination of a range of result rows: for each array, a pointer to the entry of the first row; null for columns that
// are not returned.
template <class T>
using Pointer = T*;
using RowSpans = ColumnArrays<Pointer>;

// Returns the encoded size of one row with these columns, in bytes.
constexpr uint32_t row_bytes(ColumnSet columns) {
  uint32_t bytes = 0;
  for_each_column_array([&bytes, columns](const auto& array) {
    RowSpans spans;
    if (columns.has(array.column)) bytes += array.width * uint32_t{sizeof(*array.get(spans))};
  });
  return bytes;
}
static_assert(
    [] {
      for (int value = 1; value <= static_cast<int>(kLastColumn); ++value)
        if (row_bytes({static_cast<Column>(value)}) == 0) return false;
      return true;
    }(),
    "a column has no array");

// Returns the columns that `block` may request, which depend on the kind of the block.
ColumnSet served_columns(const QueryBlock& block);
// Returns the columns that the block returns: the requested columns, or the default columns of its kind if the block
// requests no columns. Returns no columns if count_only is set.
ColumnSet returned_columns(const QueryBlock& block);

// Layout of a block's result. kDense has one row per query, even for a miss. kBytes has no rows, but one byte per
// query. kMatrix has no rows, but bytes_per_query() bytes per query. kCounted has any number of rows per query, and a
// column with the number of rows of each query. With count_only, a kCounted result has this column, but no rows.
enum class RowLayout : uint8_t { kDense, kBytes, kMatrix, kCounted };
RowLayout row_layout(const QueryBlock& block);
// Returns the number of bytes of each query of a kBytes or kMatrix block.
size_t bytes_per_query(const QueryBlock& block);
// Returns the maximum number of rows of each query of a kCounted block.
uint64_t max_rows_per_query(const QueryBlock& block);

// Returns an upper bound of the encoded size of a reply in bytes, without the rows of kCounted blocks. Includes dense
// rows, bytes of kBytes and kMatrix blocks, row counts, effective times, lists of truncated and unanchored queries, and
// field headers.
uint64_t fixed_reply_bytes(const QueryBatch& batch);
// Returns the batch's max_reply_bytes, or limits::kDefaultReplyBytes if max_reply_bytes is 0.
uint64_t reply_limit(const QueryBatch& batch);

// Returns an upper bound of the encoded size of the reply in bytes, including the rows of kCounted blocks. The result
// is at most reply_limit().
uint64_t max_encoded_reply_bytes(const QueryBatch& batch);

// Returns INVALID_ARGUMENT with reason LIMIT if fixed_reply_bytes() alone exceeds reply_limit().
absl::Status check_reply_size(const QueryBatch& batch);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_COLUMNS_H_
