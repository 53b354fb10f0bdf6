// Conversion of answers to queries into reports. For the query and get commands. Functions without state.
#ifndef LOCUS_CLIENT_CLI_ROWS_QUERY_REPORT_H_
#define LOCUS_CLIENT_CLI_ROWS_QUERY_REPORT_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/output.h"
#include "client/lib/client.h"
#include "client/lib/values.h"

namespace locus::cli {

struct RowLayout {
  std::string query = {};                // key of each row's query index: "ray", "ball"; empty = no such key
  std::vector<v1::Column> columns = {};  // requested columns, in the order of the output
  client::Double3 frame = {};            // frame of the block, which is added to the points of the answer
  uint64_t first_query = 0;              // index of the block's first query in the whole input
  bool dense = false;                    // each query has one row, with `hit` false for a miss
  bool as_of = false;                    // each row has its query's effective time, as the last key
};

// Returns the rows of one block. `layout` selects their keys among t, id, triangle, uv, normal, point, group, tag,
// layers, other, position, rotation, shape and the sizes of the shape. In the row of a miss all these keys are null.
absl::StatusOr<std::vector<Json>> rows_json(const v1::BlockResult& block, const RowLayout& layout);

// Returns the keys of rows_json() for this layout, in their order.
std::vector<std::string> row_keys(const RowLayout& layout);

Json work_json(const v1::Work& work);

// Returns the head of a report. It contains epoch, revision and tick. It also contains, if there are any: the indices
// of truncated queries; the effective times of queries about the past; the indices of the queries whose times were
// clamped to the history; the indices of the queries that have no rows because of their anchor
// (ResultRows::unanchored()); the work that the server reported.
Json result_head(const v1::QueryResult& result);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_QUERY_REPORT_H_
