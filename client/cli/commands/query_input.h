// Queries read from files, as batches: rows as `locus query KIND --from-csv` or `--from-ndjson` reads them. For
// commands that ask a user's own queries. Functions without state.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_QUERY_INPUT_H_
#define LOCUS_CLIENT_CLI_COMMANDS_QUERY_INPUT_H_

#include <string>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "client/cli/context.h"

namespace locus::cli {

struct QueryInput {
  std::string path;  // .csv has a header line, any other file a JSON object a line; "-" is standard input
  std::string kind;  // of the rows, as in `locus query KIND`; empty: known by the columns
};

// Adds the option --kind.
void add_input_kind_option(CLI::App& command, std::string& kind);

// Passes the rows of the input to `sink`, in batches of 64 rows that name the scene in no way, with the file and lines
// of each batch. Stops at the first error of `sink` and returns it. Returns NOT_FOUND if the file cannot be read, a
// usage error if its columns name no kind, INVALID_ARGUMENT if it has no rows; each names the file.
absl::Status for_each_query_batch(const QueryInput& input, const std::string& scene, Context& context,
                                  const BatchSink& sink);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_QUERY_INPUT_H_
