// `locus dump`, and the list of instances that `locus instance list` shows. Functions without state.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_DUMP_COMMAND_H_
#define LOCUS_CLIENT_CLI_COMMANDS_DUMP_COMMAND_H_

#include <string>

#include "absl/status/status.h"
#include "client/cli/commands/view_options.h"
#include "client/cli/context.h"

namespace locus::cli {

// Texts of a dump: the name of its rows in JSON, and the text for no rows.
struct DumpTexts {
  const char* rows_name;
  const char* no_rows;
};

// Writes the objects and instances of a scene that `view` selects, ascending by id, each row when it arrives.
absl::Status dump_things(const std::string& scene, const ViewOptions& view, const DumpTexts& texts, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_DUMP_COMMAND_H_
