#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct HealthOptions {
  std::string service;
};

std::string name_of(client::Health health) {
  switch (health) {
    case client::Health::kUnknown:
      return "UNKNOWN";
    case client::Health::kServing:
      return "SERVING";
    case client::Health::kNotServing:
      return "NOT_SERVING";
    case client::Health::kServiceUnknown:
      return "SERVICE_UNKNOWN";
  }
  return "UNKNOWN";
}

absl::Status health(const HealthOptions& options, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const client::Health health, client->health(options.service));
  Report report;
  report.head = {{"address", context.address()}, {"status", name_of(health)}};
  context.write(report);
  if (health == client::Health::kServing) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("the server at ", context.address(), " answers, but is ", name_of(health)));
}

}  // namespace

void add_health_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<HealthOptions>();
  CLI::App& command = *parent.add_subcommand("health", "Ask whether the server serves; exits 0 if so");
  command.footer("Examples:\n  locus health\n  locus -a 127.0.0.1:7575 --timeout 2 health");
  command.add_option("--service", options->service, "One gRPC service by its full name [the whole server]")
      ->type_name("NAME");
  run_when_chosen(command, options, context, health);
}

}  // namespace locus::cli
