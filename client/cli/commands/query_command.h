// Subcommands of `locus query`, one file per kind of query. Internal to commands/; other code uses commands.h.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_QUERY_COMMAND_H_
#define LOCUS_CLIENT_CLI_COMMANDS_QUERY_COMMAND_H_

#include <string>

#include "CLI/CLI.hpp"
#include "absl/status/statusor.h"
#include "client/cli/commands/query_options.h"
#include "client/cli/context.h"
#include "client/cli/rows/query_report.h"

namespace locus::cli {

void add_query_ray(CLI::App& parent, Context& context);
void add_query_ball(CLI::App& parent, Context& context);
void add_query_box(CLI::App& parent, Context& context);
void add_query_nearest(CLI::App& parent, Context& context);

// Asks a batch of one block and returns the result. DATA_LOSS if the result has another number of blocks.
absl::StatusOr<v1::QueryResult> ask_block(const QueryOptions& options, client::QueryBuilder& builder, Context& context);

// Asks a batch of one block and writes its rows, in `layout`, under the key `rows_name`.
absl::Status ask_and_report(const QueryOptions& options, client::QueryBuilder& builder, const RowLayout& layout,
                            const std::string& rows_name, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_QUERY_COMMAND_H_
