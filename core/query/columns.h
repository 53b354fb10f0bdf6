// Table of the result columns of a block: their names, element types and widths. Also defines which columns each kind
// of query can return, and computes their size in a reply.
//
// To add a column: add a value to Column (query_batch.h), an array to ColumnArrays, a name to kColumnNames and a row to
// kColumnArrays; write the values in run/rows.cc; and map the column to its protocol field in
// server/convert/result_columns.cc. All code that allocates, copies or measures columns loops over kColumnArrays.
#ifndef LOCUS_CORE_QUERY_COLUMNS_H_
#define LOCUS_CORE_QUERY_COLUMNS_H_

#include <array>
#include <tuple>
#include <utility>

#include "absl/strings/string_view.h"
#include "core/query/query_batch.h"

namespace locus {

// Arrays of the result columns. Array<T> is a std::vector<T> in CollectedRows, which owns rows, and a T* in RowSpans,
// which points to rows in a reply or in CollectedRows.
template <template <class> class Array>
struct ColumnArrays {
  Array<float> t{};
  Array<uint64_t> ids{};
  Array<uint32_t> triangles{};
  Array<float> uvs{};
  Array<float> normals{};
  Array<float> points{};  // relative to the block's frame
  Array<uint64_t> groups{};
  Array<uint64_t> tags{};
  Array<uint32_t> layers{};
  Array<double> positions{};
  Array<float> rotations{};
  Array<uint64_t> others{};
};

// Entry of kColumnArrays: the result column `column` stores `width` values for each result row in the array that get()
// returns.
template <class Get>
struct ColumnArray {
  Column column;
  uint32_t width;
  Get get;
};
template <class Get>
ColumnArray(Column, uint32_t, Get) -> ColumnArray<Get>;

// Table of the result columns, with one entry for each array of ColumnArrays. The table is exempt from formatting,
// because clang-format 14 would split the lambdas.
// clang-format off
inline constexpr auto kColumnArrays = std::make_tuple(
    ColumnArray{Column::kT, 1, [](auto& arrays) -> auto& { return arrays.t; }},
    ColumnArray{Column::kId, 1, [](auto& arrays) -> auto& { return arrays.ids; }},
    ColumnArray{Column::kTriangle, 1, [](auto& arrays) -> auto& { return arrays.triangles; }},
    ColumnArray{Column::kUv, 2, [](auto& arrays) -> auto& { return arrays.uvs; }},
    ColumnArray{Column::kNormal, 3, [](auto& arrays) -> auto& { return arrays.normals; }},
    ColumnArray{Column::kPoint, 3, [](auto& arrays) -> auto& { return arrays.points; }},
    ColumnArray{Column::kGroup, 1, [](auto& arrays) -> auto& { return arrays.groups; }},
    ColumnArray{Column::kTag, 1, [](auto& arrays) -> auto& { return arrays.tags; }},
    ColumnArray{Column::kLayers, 1, [](auto& arrays) -> auto& { return arrays.layers; }},
    ColumnArray{Column::kPose, 3, [](auto& arrays) -> auto& { return arrays.positions; }},
    ColumnArray{Column::kPose, 4, [](auto& arrays) -> auto& { return arrays.rotations; }},
    ColumnArray{Column::kOther, 1, [](auto& arrays) -> auto& { return arrays.others; }});
// clang-format on

// Column names indexed by the value of Column: the protocol's names without the prefix "COLUMN_".
inline constexpr std::array<absl::string_view, 12> kColumnNames = {
    "UNSPECIFIED", "T", "ID", "TRIANGLE", "UV", "NORMAL", "POINT", "GROUP", "TAG", "LAYERS", "POSE", "OTHER"};
static_assert(kColumnNames.size() == static_cast<size_t>(kLastColumn) + 1);

// Calls visit() with each entry of kColumnArrays, in the order of the table.
template <class Visit>
constexpr void for_each_column_array(const Visit& visit) {
  std::apply([&visit](const auto&... array) { (visit(array), ...); }, kColumnArrays);
}

// Destination of a range of result rows: for each array, a pointer to the entry of the first row; null for columns that
// are not returned.
template <class T>
using Pointer = T*;
using RowSpans = ColumnArrays<Pointer>;

// Returns the name of a column as in kColumnNames.
constexpr absl::string_view column_name(Column column) { return kColumnNames[static_cast<size_t>(column)]; }

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
// requests no columns.
ColumnSet returned_columns(const QueryBlock& block);

// Layout of a block's result. kDense has one row per query, also for a miss. kBytes has one byte per query and no rows.
// kMatrix has the same number of bytes, bytes_per_query(), for each query and no rows. kCounted has any number of rows
// per query, and a column with the number of rows of each query; with count_only, only this column.
enum class RowLayout : uint8_t { kDense, kBytes, kMatrix, kCounted };
RowLayout row_layout(const QueryBlock& block);
// Returns the number of bytes of each query of a kBytes or kMatrix block.
size_t bytes_per_query(const QueryBlock& block);
// Returns the maximum number of rows of each query of a kCounted block.
uint64_t max_rows_per_query(const QueryBlock& block);

// Returns an upper bound of the encoded size of a reply in bytes, without the rows of kCounted blocks: dense rows, row
// counts, effective times, lists of truncated queries, and field headers.
uint64_t fixed_reply_bytes(const QueryBatch& batch);
// Returns the batch's max_reply_bytes, or limits::kDefaultReplyBytes if max_reply_bytes is 0.
uint64_t reply_limit(const QueryBatch& batch);

// Returns an upper bound of the encoded size of the reply in bytes, rows of kCounted blocks included; at most
// reply_limit().
uint64_t max_encoded_reply_bytes(const QueryBatch& batch);

// Returns INVALID_ARGUMENT with reason LIMIT if fixed_reply_bytes() alone exceeds reply_limit().
absl::Status check_reply_size(const QueryBatch& batch);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_COLUMNS_H_
