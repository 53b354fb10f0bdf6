// `locus config show`: the effective daemon configuration, read by the daemon's own parser.
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "server/config/config_origins.h"

namespace locus::cli {
namespace {

struct ConfigOptions {
  bool origin = false;
  std::string file;
  std::vector<std::string> flags;
};

absl::Status show(const ConfigOptions& options, Context& context) {
  std::vector<std::string> arguments = options.flags;
  if (!options.file.empty()) arguments.insert(arguments.begin(), {"--config", options.file});
  const absl::StatusOr<std::vector<server::ConfigValue>> values =
      server::config_origins(arguments, server::process_environment);
  if (!values.ok()) return usage_error(values.status().message());
  Report report;
  report.rows_name = "options";
  for (const server::ConfigValue& value : *values) {
    Json row = {{"option", value.name}, {"value", value.value}};
    if (options.origin) {
      row["origin"] = server::origin_name(value.origin);
      row["place"] = value.place;
    }
    report.rows.push_back(std::move(row));
  }
  context.write(report);
  return absl::OkStatus();
}

}  // namespace

void add_config_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<ConfigOptions>();
  CLI::App& config = *parent.add_subcommand("config", "Look at the options of locusd");
  config.require_subcommand(1);
  config.footer(
      "Examples:\n  locus config show --origin\n  locus config show --origin --config /etc/locus/locusd.conf");
  CLI::App& command = *config.add_subcommand("show", "Print what locusd would run with here, without starting it");
  command.footer(
      R"(A flag wins over the environment (LOCUS_...), which wins over the file. What follows the machine, threads and
memory-limit, is shown as it comes out on this one.

Examples:
  locus config show
  locus config show --origin
  locus config show --origin --config /etc/locus/locusd.conf
  locus -o json config show --origin -- --listen 127.0.0.1:0 --threads 2)");
  command.add_flag("--origin", options->origin, "Also where each value comes from: flag, variable, file and line");
  command.add_option("--config", options->file, "File that locusd would be given")->type_name("FILE");
  command.add_option("flags", options->flags, "Flags that locusd would be given, after --")->type_name("FLAGS");
  run_when_chosen(command, options, context, show);
}

}  // namespace locus::cli
