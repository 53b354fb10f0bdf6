// Sending of one update batch and printing of its ack. For the insert, move and remove commands.
#ifndef LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_
#define LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_

#include <string>

#include "absl/status/status.h"
#include "client/cli/context.h"
#include "client/lib/client.h"

namespace locus::cli {

// Applies the batch and writes the ack: applied, refused, revision, tick, epoch, and a row for each listed refused
// item. If items were refused, writes the ack and returns the error of refused_items(). While a batch is open
// (Context::pending_batch()), adds the changes to it instead and writes nothing.
absl::Status apply_and_report(const std::string& scene, v1::UpdateBatch batch, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_
