#include <memory>
#include <string>

#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct NoOptions {};

// Returns a limit's value as a JSON integer if it is an integer from 0 to 2^53, so that counts are printed without a
// decimal point. Returns any other value as a double.
Json number_json(double value) {
  constexpr double kExactIntegers = 9007199254740992.0;
  if (value < 0 || value > kExactIntegers || value != static_cast<double>(static_cast<uint64_t>(value))) return value;
  return static_cast<uint64_t>(value);
}

absl::Status limits(const NoOptions&, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const v1::GetServerResponse server, client->get_server());
  Report report;
  report.rows_name = "limits";
  for (const v1::Limit& limit : server.limits()) {
    report.rows.push_back({{"name", limit.name()},
                           {"value", number_json(limit.value())},
                           {"used", server.use_hidden() ? Json() : number_json(limit.used())},
                           {"refused", server.use_hidden() ? Json() : Json(limit.refused())}});
  }
  context.write(report);
  return absl::OkStatus();
}

}  // namespace

void add_limits_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand(
      "limits", "List every limit of the server, how much is in use, and how often it refused something");
  command.footer(
      "The limits memory_... are what memory_bytes is used for. memory_history, memory_pinned, memory_scenes,\n"
      "memory_meshes, memory_caches, memory_reusable and memory_network are measured, the others claimed by work in\n"
      "progress. Of pinned, caches and network, the value is the most that they may take; of the others, the use of\n"
      "the whole process at which they give way or are refused. memory_reusable is free memory that the allocator\n"
      "holds for later; an idle server returns it to the system if it exceeds the value. memory_live is the sum of\n"
      "all live allocations, whatever they are used for.\n"
      "`refused` counts calls, messages and connections since the server started. On a server with access control,\n"
      "only callers with the right `metrics` or `admin *` see `used` and `refused`.\n"
      "Examples:\n  locus limits\n  locus -o json limits");
  run_when_chosen(command, std::make_shared<NoOptions>(), context, limits);
}

}  // namespace locus::cli
