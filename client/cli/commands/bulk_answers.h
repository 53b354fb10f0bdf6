// Writer that prints the answers to bulk queries as one report while they arrive. For bulk_query.cc. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_BULK_ANSWERS_H_
#define LOCUS_CLIENT_CLI_COMMANDS_BULK_ANSWERS_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/context.h"
#include "client/cli/report_stream.h"
#include "client/cli/rows/bulk/sent_rows.h"
#include "client/cli/rows/query_report.h"
#include "client/lib/client.h"
#include "client/lib/values.h"

namespace locus::cli {

struct BulkQuery;

class BulkAnswers {
 public:
  // Borrows `query` and `context`. With `follow`, answers may have different revisions, and the report contains the
  // first and the newest revision.
  BulkAnswers(const BulkQuery& query, bool follow, Context& context);

  // Appends the rows of `result`, the answer to one query message. `sent` contains the input rows of this message, and
  // `frames` the frame of each of its blocks. Returns DATA_LOSS if the answer does not match the message, UNKNOWN if
  // the output cannot be written.
  absl::Status write(const v1::QueryResult& result, const SentRows& sent, const std::vector<client::Double3>& frames);

  // Completes the report. Does nothing if no answer was written.
  void end();

  // Returns the newest revision among the answers; nullopt before the first answer.
  std::optional<client::Revision> revision() const { return revision_; }
  // Returns the number of input rows that were answered so far.
  uint64_t rows() const { return rows_; }

 private:
  absl::Status write_block(const v1::BlockResult& block, size_t rows, RowLayout layout);
  // Adds the row of a query whose answer is one bit.
  void add_bit(const v1::BlockResult& block, size_t query, const RowLayout& layout, const char* key, bool value);
  void note(const v1::QueryResult& result);
  Json tail() const;

  const BulkQuery& query_;
  const bool follow_;
  Context& context_;
  ReportStream report_;
  std::optional<client::Revision> revision_;
  uint64_t first_revision_ = 0;
  uint64_t tick_ = 0;
  uint64_t rows_ = 0;
  uint64_t truncated_ = 0;
  size_t clamped_ = 0;
  Json truncated_rows_ = Json::array();  // row indices of the first truncated queries
  v1::Work work_;
  bool has_work_ = false;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_BULK_ANSWERS_H_
