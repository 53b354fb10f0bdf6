// The parser of locusd's command line and of its file: for server_config.cc, which reads with it, and for the manual,
// which is written from it. Not for the rest of the server, which sees a ServerConfig only.
#ifndef LOCUS_SERVER_CONFIG_SERVER_PARSER_H_
#define LOCUS_SERVER_CONFIG_SERVER_PARSER_H_

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "server/config/server_config.h"

namespace locus::server {

// Adds name, help, every option and the file of --config to `app`, which keeps pointers into `config`. The environment
// is no matter of the parser: see environment_variable().
void build_parser(CLI::App& app, ServerConfig& config);

// Adds the commands `check` and `repair`. The one that is chosen is in `chosen` once a line is parsed.
void add_maintenance(CLI::App& app, std::optional<Maintenance>& chosen);

// Whether an empty variable sets the option, to nothing, rather than being as good as none.
bool may_be_empty(const std::string& option);

// The variable that sets an option: "drain-grace-s" is set by LOCUS_DRAIN_GRACE_S.
std::string environment_variable(const std::string& option);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_SERVER_PARSER_H_
