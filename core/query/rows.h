// From hits to result columns: which columns a block returns, how large its rows are, and how they are written.
#ifndef LOCUS_CORE_QUERY_ROWS_H_
#define LOCUS_CORE_QUERY_ROWS_H_

#include "absl/strings/string_view.h"
#include "core/query/answer_sink.h"
#include "core/query/found_objects.h"
#include "core/query/hit.h"
#include "core/query/nearest_query.h"
#include "core/query/query_batch.h"
#include "core/query/ray_query.h"

namespace locus {

// "T", "ID" and so on.
absl::string_view column_name(Column column);

// What a block's kind can return, and what it does return: the wanted columns or the kind's default ones.
ColumnSet served_columns(const QueryBlock& block);
ColumnSet returned_columns(const QueryBlock& block);

// How a block's answer is laid out. Dense: one row a query, a miss included. Bytes: one byte a query, no rows. Counted:
// any number of rows a query.
enum class RowLayout : uint8_t { kDense, kBytes, kCounted };
RowLayout row_layout(const QueryBlock& block);

// Encoded bytes of one row.
uint32_t row_bytes(ColumnSet columns);

// Encoded bytes that a batch's answer takes before its first counted row: dense rows, counts, room for lists of cut
// queries and for field headers.
uint64_t fixed_reply_bytes(const QueryBatch& batch);
uint64_t reply_limit(const QueryBatch& batch);

// INVALID_ARGUMENT LIMIT where fixed_reply_bytes() alone is over the batch's limit.
absl::Status check_reply_size(const QueryBatch& batch);

// Writes the columns of row `row` that every kind has; a miss where `hit` names nothing.
void write_row(const Hit& hit, const RowSpans& to, size_t row);
// Writes a row like `hit` for each of some triangles, from row `row` on.
void write_triangle_rows(const Hit& hit, absl::Span<const uint32_t> triangles, const RowSpans& to, size_t row);
// Writes a row for each of some objects, as they were at `moment`, from the first row on.
void write_object_rows(absl::Span<const FoundObject> objects, const Moment& moment, const RowSpans& to);
// Writes what only hits of rays have: uv, normal and point, the latter relative to the frame.
void write_surface(const RayRequest& request, Vec3d frame, const Hit& hit, Winding winding, const RowSpans& to,
                   size_t row);

// Writes the point of a row of what is nearest, relative to the frame, where it is wanted.
void write_nearest_point(const NearestRequest& request, Vec3d frame, const Hit& hit, const RowSpans& to, size_t row);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_ROWS_H_
