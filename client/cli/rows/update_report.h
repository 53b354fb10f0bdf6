// Function that sends one update batch and prints its ack. For the insert, move and remove commands.
#ifndef LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_
#define LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_

#include <string>

#include "absl/status/status.h"
#include "client/cli/context.h"
#include "client/lib/client.h"

namespace locus::cli {

// Returns the line that acknowledges updates of which `applied` items were applied; `ack` is the last ack.
std::string applied_text(uint64_t applied, const v1::UpdateAck& ack);

// Sends the batch and writes its ack: applied, refused, revision, tick, epoch, and a row for each refused item that the
// ack lists. In a table, an ack without refused items is one line. Then returns the result of refused_items(), which is
// an error if items were refused.
absl::Status apply_and_report(const std::string& scene, v1::UpdateBatch batch, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_
