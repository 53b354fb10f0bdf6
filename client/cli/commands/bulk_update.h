// Runner of updates whose rows are read from a file or a pipe: sends them in batches, which are applied in the order of
// the input. For insert, move and remove. Holds at most kBulkWindow batches in memory, however long the input is, or,
// with
// --one-revision, the kMaxUpdateItems rows that can become one revision.
//
// Each batch becomes one revision. A batch ends after --batch rows, or when the input has no data ready (see
// kRowPause). Therefore, if a process writes the moves of one time step to a pipe and then waits, these moves become
// one revision. A row that the server refuses is listed in the report, and the rest of its batch is applied. A
// malformed row (text instead of a number, a missing column) ends the run: no row of its batch is sent, and the message
// contains the number of rows applied before that batch. With --one-revision, nothing is sent before the input has
// ended.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_BULK_UPDATE_H_
#define LOCUS_CLIENT_CLI_COMMANDS_BULK_UPDATE_H_

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "client/cli/commands/bulk_options.h"
#include "client/cli/context.h"
#include "client/lib/client.h"

namespace locus::cli {

// Properties of a bulk update that depend on the command.
struct BulkUpdate {
  RowSchema schema;
  // Optional. Returns an error if fields of row `row` contradict each other.
  std::function<absl::Status(const RowBatch& batch, size_t row)> check_row;
  // Returns the update message for all rows of `batch`, which may be empty. Within each list of the message, the rows
  // keep the order of the input.
  std::function<v1::UpdateBatch(const RowBatch& batch)> batch_of;
};

// Reads rows and sends updates until the input ends, and writes one report. As soon as an ack arrives, the items that
// it lists as refused are written as rows (line, id, reason). The report ends with applied, refused, batches, revision,
// tick and epoch. Returns the first error, if there is one. Without an error, returns OK if the server refused no item,
// NOT_FOUND if all refused items have unknown ids, and FAILED_PRECONDITION in any other case.
absl::Status run_bulk_update(const BulkUpdate& update, const std::string& scene, const BulkOptions& bulk,
                             Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_BULK_UPDATE_H_
