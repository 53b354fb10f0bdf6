// Runner of queries whose rows are read from a file or a pipe: sends the rows in batches and writes the answers in the
// order of the input. For the query commands. Holds at most kBulkWindow batches and their answers in memory, however
// long the input is.
//
// Without `follow`, all rows are answered at one revision: the options select the revision of the first batch, and
// every later batch requests exactly the revision of the first answer. The server retains a bounded number of
// revisions. If it drops the requested revision, the run ends with OUT_OF_RANGE after the answers received so far. With
// `follow`, each batch is answered at the scene's newest revision. The server may answer batches that are in flight
// together in any order, so an answer can have an older revision than the answer before it.
//
// The answer to a row does not depend on the other rows of its batch, because the frame used for a row depends only on
// the position in this row (frame_of).
#ifndef LOCUS_CLIENT_CLI_COMMANDS_BULK_QUERY_H_
#define LOCUS_CLIENT_CLI_COMMANDS_BULK_QUERY_H_

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "client/cli/commands/bulk_options.h"
#include "client/cli/commands/query_options.h"
#include "client/cli/context.h"
#include "client/cli/rows/query_report.h"
#include "client/lib/query_builder.h"

namespace locus::cli {

// Rows of a batch that share a frame and are sent as one block.
struct BlockRows {
  const RowBatch& batch;
  RowSpan rows;
  client::Double3 frame;
  // Three floats per row: position (field 0 of the schema) relative to `frame`. Empty if has_position is false.
  std::vector<float> offsets;
};

// Content of a row of the answer.
enum class BulkAnswer {
  kRows,  // the requested columns
  kHits,  // rays and sweeps in mode ANY: `hit`
  kSeen,  // pairwise sight: `seen`
};

// Properties of a bulk query that depend on the kind of query.
struct BulkQuery {
  RowSchema schema;  // field 0 must be the position, if the query has one
  RowLayout layout;
  std::string rows_name;
  BulkAnswer answer = BulkAnswer::kRows;
  bool has_position = true;  // false: the frame of all rows is the origin
  std::function<void(const BlockRows& rows, client::QueryBuilder& builder)> add_block;
};

// Returns the frame to use for a position. The frame is the origin if every coordinate is exactly representable as a
// float. Otherwise it is the nearest point of a grid of spacing 16,384, so that rounding the offset to float moves the
// position by less than 0.0005.
client::Double3 frame_of(double x, double y, double z);

// Returns the values of the column `positions` in `rows` relative to the frame, three floats for each row.
std::vector<float> offsets_of(const RowColumn& positions, RowSpan rows, const client::Double3& frame);

// Returns the schema field of a position, whose column in the input is named "at" or "position".
Field at_field();

// Appends the fields that every kind of query has to the schema: mask, ignore_group, self_id, only_group, tag and
// tag_mask. A row with a tag_mask and without a tag is malformed.
void add_filter_fields(const QueryOptions& options, RowSchema& schema);

// Columns tags and tag_masks of a block. Both are empty if no tag is given.
struct TagColumns {
  std::vector<uint64_t> tags;
  std::vector<uint64_t> masks;
};
// Returns the columns for the fields tag, with index `tag_field` in the schema, and tag_mask, which follows it. A row
// without a tag finds every tag, and a row without a mask compares all bits.
TagColumns tag_columns(const QueryOptions& options, const BlockRows& rows, size_t tag_field);

// Sets the filter columns of a block from the rows. `first` is the index of the field mask in the schema; the other
// fields of add_filter_fields() follow it.
template <class Block>
void apply_filter_columns(const QueryOptions& options, const BlockRows& rows, size_t first, Block& block) {
  const std::vector<RowColumn>& columns = rows.batch.columns;
  block.masks(bits_column(columns[first], rows.rows, client::kEveryMask, values32_of(options.masks)));
  block.ignore_groups(id_column(columns[first + 1], rows.rows, 0, values_of(options.ignore_groups)));
  block.self_ids(id_column(columns[first + 2], rows.rows, 0, values_of(options.self_ids)));
  if (columns[first + 3].any()) block.only_groups(id_column(columns[first + 3], rows.rows, 0, {}));
  const TagColumns tags = tag_columns(options, rows, first + 4);
  block.tags(tags.tags, tags.masks);
}

// Returns a usage error for query options that cannot be combined with rows from an input.
absl::Status check(const QueryOptions& options, const BulkOptions& bulk);

// Reads rows, sends queries and writes answers until the input ends. If the context has a batch sink, passes each batch
// to it instead of sending it, without a view, and writes no answers. If a row is invalid, the error's message names
// the line of the input. If rows were answered before an error, their answers are written, and the error's message
// contains the number of these rows.
absl::Status run_bulk_query(const BulkQuery& query, const QueryOptions& options, const BulkOptions& bulk,
                            Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_BULK_QUERY_H_
