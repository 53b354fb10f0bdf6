// Updates whose rows are read from a file or a pipe, sent in batches and applied in the order of the input. For insert,
// move and remove. Keeps at most kBulkWindow batches in memory, however long the input is.
//
// Each batch is one revision. A batch ends after --batch rows or when the input pauses, so that the moves of one time
// step are applied at once if a pipe writes them and then waits. A row that the server refuses is listed, and the rest
// of its batch is applied. A malformed row (not a number, a missing column) ends the run: no row of its batch is sent,
// and the message says how many rows were applied before.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_BULK_UPDATE_H_
#define LOCUS_CLIENT_CLI_COMMANDS_BULK_UPDATE_H_

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "client/cli/commands/bulk_options.h"
#include "client/cli/context.h"
#include "client/lib/client.h"

namespace locus::cli {

// Parts of a bulk update that depend on the command.
struct BulkUpdate {
  RowSchema schema;
  // Returns an error if the fields of a row contradict each other. Optional.
  std::function<absl::Status(const RowBatch& batch, size_t row)> check_row;
  // Returns the update with all rows, in the order of the input within each list. `batch` may be empty.
  std::function<v1::UpdateBatch(const RowBatch& batch)> batch_of;
};

// Reads and sends until the input ends and writes one report: a row (line, id, reason) for each refused item that the
// server lists, as soon as its ack arrives, and at the end applied, refused, batches, revision, tick and epoch. Returns
// the first error; without one, an error for refused items like that of refused_items(), or OK.
absl::Status run_bulk_update(const BulkUpdate& update, const std::string& scene, const BulkOptions& bulk,
                             Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_BULK_UPDATE_H_
