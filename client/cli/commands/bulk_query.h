// Queries whose rows come from a file or a pipe: read, asked and answered in pieces, answers in the order of the input.
// For the query commands. Holds kBulkWindow batches and their answers, whatever the input's length.
//
// One revision answers the whole input: the first batch is asked as the options say, and every later one `exactly` at
// the revision that answered it. A scene keeps a bounded number of revisions; when that one is gone, the run ends with
// OUT_OF_RANGE and what was answered stays. With `follow` each batch is asked at the newest revision instead, never an
// older one than an answer already received.
//
// A row's answer does not depend on the rows it shares a batch with, nor on where batches end: its frame is a function
// of its own position (frame_of).
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

// Rows of a batch that share a frame, as the block that asks about them.
struct BlockRows {
  const RowBatch& batch;
  RowSpan rows;
  client::Double3 frame;
  std::vector<float> offsets;  // 3 a row: field 0 of the schema, relative to the frame
};

// What differs from kind to kind.
struct BulkQuery {
  RowSchema schema;  // its first field is the position
  RowLayout layout;
  std::string rows_name;
  bool any = false;  // rays ANY: rows of `hit` only
  std::function<void(const BlockRows& rows, client::QueryBuilder& builder)> add_block;
};

// The origin where every coordinate is a float or near it, else the nearest corner of a grid of 16,384, so that an
// offset is off by less than 0.0005.
client::Double3 frame_of(double x, double y, double z);

// The fields that every kind of query may have in its rows: mask and ignore_group.
void add_filter_fields(const QueryOptions& options, RowSchema& schema);
// Their columns; `first` is where add_filter_fields() put the first.
template <class Block>
void apply_filter_columns(const QueryOptions& options, const BlockRows& rows, size_t first, Block& block) {
  block.masks(bits_column(rows.batch.columns[first], rows.rows, client::kEveryMask, values32_of(options.masks)));
  block.ignore_groups(id_column(rows.batch.columns[first + 1], rows.rows, 0, values_of(options.ignore_groups)));
}

// Usage error for query options that do not go with rows.
absl::Status check(const QueryOptions& options, const BulkOptions& bulk);

// Reads, asks and writes until the input ends. Errors of the input name its line; whatever ends a run early, the
// answers before it are written, and the message says how many rows they are for.
absl::Status run_bulk_query(const BulkQuery& query, const QueryOptions& options, const BulkOptions& bulk,
                            Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_BULK_QUERY_H_
