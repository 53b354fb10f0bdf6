// Subcommands of `locus query`, one source file per kind of query. Internal to commands/; other code includes
// commands.h.
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
void add_query_capsule(CLI::App& parent, Context& context);
void add_query_sweep(CLI::App& parent, Context& context);
void add_query_frustum(CLI::App& parent, Context& context);
void add_query_contains(CLI::App& parent, Context& context);
void add_query_sight(CLI::App& parent, Context& context);
void add_query_nearest(CLI::App& parent, Context& context);
void add_query_pairs(CLI::App& parent, Context& context);
void add_query_cell(CLI::App& parent, Context& context);

// Sends a batch of one block and returns the result. Returns DATA_LOSS if the result does not have exactly one block.
absl::StatusOr<v1::QueryResult> ask_block(const QueryOptions& options, client::QueryBuilder& builder, Context& context);

// Sends a batch of one block and writes the rows of its result in the given layout. `rows_name` is the key of the list
// of rows in JSON.
absl::Status ask_and_report(const QueryOptions& options, client::QueryBuilder& builder, const RowLayout& layout,
                            const std::string& rows_name, Context& context);

// Sends a batch of one block of rays or sweeps in mode ANY, and writes for each ray or sweep whether it hits something.
// `query` is the report's key for the index of the ray or sweep, for example "ray".
absl::Status ask_and_report_any(const QueryOptions& options, client::QueryBuilder& builder, const std::string& query,
                                Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_QUERY_COMMAND_H_
