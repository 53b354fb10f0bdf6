// What insert, move and remove have in common: sending one batch and printing its ack. For those commands.
#ifndef LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_
#define LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_

#include <string>

#include "absl/status/status.h"
#include "client/cli/context.h"
#include "client/lib/client.h"

namespace locus::cli {

// Applies the batch and writes the ack: applied, refused, revision, tick, and a row for each refused item listed. The
// answer is written even if items were refused; the status then says so. While a batch is open, the changes go into it
// instead and nothing is written.
absl::Status apply_and_report(const std::string& scene, v1::UpdateBatch batch, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_UPDATE_REPORT_H_
