// Function that sends one update batch and prints its ack. For the insert, move and remove commands.
#ifndef LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_
#define LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_

#include <string>

#include "absl/status/status.h"
#include "client/cli/context.h"
#include "client/lib/client.h"

namespace locus::cli {

// Sends the batch and writes its ack: applied, refused, revision, tick, epoch, and a row for each refused item that the
// ack lists. Then returns the result of refused_items(), which is an error if items were refused.
absl::Status apply_and_report(const std::string& scene, v1::UpdateBatch batch, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_
