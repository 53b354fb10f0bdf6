// Answers to queries as reports. For the query and get commands. Functions without state.
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
  std::string query = {};                // what a query is called: "ray", "ball"; empty = rows do not name their query
  std::vector<v1::Column> columns = {};  // what was asked for, in the order to show
  client::Double3 frame = {};            // of the block: points are shown absolute
  uint64_t first_query = 0;              // the number of the block's first query
  bool dense = false;                    // one row a query, with a `hit` that may be false
};

// Rows of one block, in the keys t, id, triangle, uv, normal, point, group, tag, layers, position, rotation. The row of
// a miss has null in all of them.
absl::StatusOr<std::vector<Json>> rows_json(const v1::BlockResult& block, const RowLayout& layout);

// The keys of such rows, in their order.
std::vector<std::string> row_keys(const RowLayout& layout);

Json work_json(const v1::Work& work);

// Epoch, revision and tick, the queries that were cut, the times of the past that were asked and which of them were
// clamped, and the work if it was reported.
Json result_head(const v1::QueryResult& result);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_QUERY_REPORT_H_
