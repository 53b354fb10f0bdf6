#include "deploy/manual/programs.h"

#include <optional>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "client/cli/run.h"
#include "server/config/server_config.h"
#include "server/config/server_parser.h"
#include "server/config/version.h"

namespace locus::manual {

std::vector<Page> pages_of_locus(Form form) {
  std::ostringstream nowhere;
  cli::Context context(nowhere, nowhere, cli::Progress::kSilent);
  CLI::App app;
  cli::build_cli(app, context);
  const Manual manual = {
      .section = "1",
      .version = LOCUS_VERSION,
      .exit_statuses = {{"0", "The command was carried out."},
                        {"1", "It failed; standard error says why."},
                        {"2", "The command line is wrong."},
                        {"3", "No server answers at the address."},
                        {"4", "The server denied the call."},
                        {"5", "The scene, mesh, object or file does not exist."}},
      .variables = {{"LOCUS_ADDRESS", "Where locusd listens, if --address is not given."},
                    {"LOCUS_CONTEXT", "The context, if --context is not given."},
                    {"LOCUS_TLS", "true encrypts the connection, like --tls."},
                    {"LOCUS_CA", "Like --ca."},
                    {"LOCUS_CERT", "Like --cert."},
                    {"LOCUS_KEY", "Like --key."},
                    {"LOCUS_SERVER_NAME", "Like --server-name."},
                    {"LOCUS_TOKEN", "The token itself, if there is no token file."},
                    {"LOCUS_TOKEN_FILE", "Like --token-file."},
                    {"LOCUS_SCENE", "The scene of commands that do not name one."},
                    {"LOCUS_METRICS_ADDRESS", "Where `locus top` reads metrics, if --metrics-address is not given."}},
      .see_also = {"locusd(8)"},
  };
  return manual_pages(cli::words_of(app), manual, form);
}

std::vector<Page> pages_of_locusd(Form form) {
  server::ServerConfig config;
  CLI::App app;
  server::build_parser(app, config);
  std::optional<server::Maintenance> maintenance;
  server::add_maintenance(app, maintenance);
  const cli::CommandWords words = cli::words_of(app);
  Manual manual = {
      .section = "8",
      .version = server::kVersion,
      .exit_statuses = {{"0", "It drained and ended after a signal, or printed its help or version."},
                        {"1", "It could not start, or the data directory is damaged; standard error says why."},
                        {"2", "Its options, environment or file are wrong."},
                        {"130", "A second signal ended it at once."}},
      .variables = {},
      .see_also = {"locus(1)", "locus-health(1)", "locus-limits(1)"},
  };
  for (const cli::OptionWords& option : words.options) {
    const std::string name = option.names.back().substr(option.names.back().find_first_not_of('-'));
    if (name == "help" || name == "version") continue;
    manual.variables.emplace_back(server::environment_variable(name), absl::StrCat("Like --", name, "."));
  }
  return manual_pages(words, manual, form);
}

}  // namespace locus::manual
