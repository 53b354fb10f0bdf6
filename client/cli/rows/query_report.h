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
  std::string query = {};                // key of the query index: "ray", "ball"; empty = rows have none
  std::vector<v1::Column> columns = {};  // requested columns, in the order of the output
  client::Double3 frame = {};            // frame of the block; it is added to points
  uint64_t first_query = 0;              // index of the block's first query
  bool dense = false;                    // one row per query, with `hit` false for a miss
};

// Returns the rows of one block, with the keys t, id, triangle, uv, normal, point, group, tag, layers, position,
// rotation. In the row of a miss all of them are null.
absl::StatusOr<std::vector<Json>> rows_json(const v1::BlockResult& block, const RowLayout& layout);

// Returns the keys of such rows, in their order.
std::vector<std::string> row_keys(const RowLayout& layout);

Json work_json(const v1::Work& work);

// Returns the head of a report: epoch, revision and tick, the truncated queries, the effective times of queries about
// the past and which of them were clamped, and the work if it was reported.
Json result_head(const v1::QueryResult& result);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_QUERY_REPORT_H_
