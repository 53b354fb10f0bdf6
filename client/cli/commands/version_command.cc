#include <memory>
#include <string>

#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct VersionOptions {
  bool server = false;
};

absl::Status version(const VersionOptions& options, Context& context) {
  Report report;
  report.head = {{"version", LOCUS_VERSION}, {"protocol", "locus.v1"}};
  if (options.server) {
    ASSIGN_OR_RETURN(client::Client* const client, context.connect());
    ASSIGN_OR_RETURN(const v1::GetServerResponse server, client->get_server());
    report.head["server_version"] = server.version();
    report.head["instruction_set"] = server.instruction_set();
    report.head["insecure"] = server.insecure();
    report.head["features"] = Json::array();
    for (const std::string& feature : server.features()) report.head["features"].push_back(feature);
  }
  context.write(report);
  return absl::OkStatus();
}

}  // namespace

void add_version_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<VersionOptions>();
  CLI::App& command = *parent.add_subcommand("version", "Print the version, with --server also the server's");
  command.footer("Examples:\n  locus version\n  locus version --server");
  command.add_flag("--server", options->server, "Also ask the server for its version and what it serves");
  run_when_chosen(command, options, context, version);
}

}  // namespace locus::cli
