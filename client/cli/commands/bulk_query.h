// Queries whose rows are read from a file or a pipe, in batches, with answers in the order of the input. For the query
// commands. Keeps at most kBulkWindow batches and their answers in memory, however long the input is.
//
// All rows are answered at one revision: the view of the first batch is given by the options, and every later batch
// asks `exactly` for the revision of the first answer. A scene keeps a bounded number of revisions; when that revision
// is dropped, the run ends with OUT_OF_RANGE, after the answers so far. With `follow`, each batch asks for the newest
// revision instead, and at least for the newest one received so far.
//
// A row's answer does not depend on the other rows of its batch, because its frame is a function of its own position
// (frame_of).
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
  std::vector<float> offsets;  // 3 per row: field 0 of the schema, relative to the frame
};

// Parts of a bulk query that depend on the kind of query.
struct BulkQuery {
  RowSchema schema;  // its first field is the position
  RowLayout layout;
  std::string rows_name;
  bool any = false;  // rays in mode ANY: rows have only `hit`
  std::function<void(const BlockRows& rows, client::QueryBuilder& builder)> add_block;
};

// Returns the frame for a position: the origin if every coordinate is exactly a float, else the nearest corner of a
// grid of spacing 16,384, so that rounding the offset to float changes it by less than 0.0005.
client::Double3 frame_of(double x, double y, double z);

// Appends the fields that rows of every kind of query may have: mask and ignore_group.
void add_filter_fields(const QueryOptions& options, RowSchema& schema);
// Sets the block's columns of these fields; `first` is the index of the first one in the schema.
template <class Block>
void apply_filter_columns(const QueryOptions& options, const BlockRows& rows, size_t first, Block& block) {
  block.masks(bits_column(rows.batch.columns[first], rows.rows, client::kEveryMask, values32_of(options.masks)));
  block.ignore_groups(id_column(rows.batch.columns[first + 1], rows.rows, 0, values_of(options.ignore_groups)));
}

// Returns a usage error for query options that cannot be used with rows from an input.
absl::Status check(const QueryOptions& options, const BulkOptions& bulk);

// Reads rows, asks and writes answers until the input ends. Errors of the input name its line. After any error the
// answers before it are written, and the message says how many rows were answered.
absl::Status run_bulk_query(const BulkQuery& query, const QueryOptions& options, const BulkOptions& bulk,
                            Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_BULK_QUERY_H_
