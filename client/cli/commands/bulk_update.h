// Updates whose rows come from a file or a pipe: read, sent and acknowledged in pieces, applied in the order of the
// input. For insert, move and remove. Holds kBulkWindow batches, whatever the input's length.
//
// Each batch is one revision. Where a batch ends is decided by --batch and by pauses of the input, so that a pipe that
// gives one time step's moves and waits has them applied at once. A row that the server refuses is listed and the rest
// of its batch is applied. A row that is wrong in itself (no number, a column missing) ends the run: nothing of its
// batch is sent, and the message says how many rows before it were.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_BULK_UPDATE_H_
#define LOCUS_CLIENT_CLI_COMMANDS_BULK_UPDATE_H_

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "client/cli/commands/bulk_options.h"
#include "client/cli/context.h"
#include "client/lib/client.h"

namespace locus::cli {

// What differs from command to command.
struct BulkUpdate {
  RowSchema schema;
  // What is wrong with one row beyond its values; none = nothing.
  std::function<absl::Status(const RowBatch& batch, size_t row)> check_row;
  // All rows, in their order within each kind of list; also called without rows.
  std::function<v1::UpdateBatch(const RowBatch& batch)> batch_of;
};

// Reads and sends until the input ends, then writes one report: applied, refused, batches, revision, tick, epoch, and a
// row (line, id, reason) for each refused item the server lists, as they come. The status is that of the first failure,
// else as refused_items() has it.
absl::Status run_bulk_update(const BulkUpdate& update, const std::string& scene, const BulkOptions& bulk,
                             Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_BULK_UPDATE_H_
