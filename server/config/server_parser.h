// The parser of locusd's command line and config file. server_config.cc and config_origins.cc use this parser, and the
// manual is generated from it. All other code of the server only uses a ServerConfig. Functions without state.
#ifndef LOCUS_SERVER_CONFIG_SERVER_PARSER_H_
#define LOCUS_SERVER_CONFIG_SERVER_PARSER_H_

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "server/config/server_config.h"

namespace locus::server {

// Adds name, help, every option and the file of --config to `app`, which keeps pointers into `config`. The parser does
// not read the environment: see environment_variable().
void build_parser(CLI::App& app, ServerConfig& config);

// Adds the commands `check`, `repair` and `config`. Parsing a command line with one of these commands sets `chosen`,
// which must outlive `app`.
void add_maintenance(CLI::App& app, std::optional<Maintenance>& chosen);

// Returns whether an empty environment variable sets the option to the empty string. For other options an empty
// variable is ignored.
bool may_be_empty(const std::string& option);

// Returns the environment variable of an option: "drain-grace-s" is set by LOCUS_DRAIN_GRACE_S.
std::string environment_variable(const std::string& option);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_SERVER_PARSER_H_
