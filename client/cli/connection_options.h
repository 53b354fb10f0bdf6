// Global options that choose the server and the credentials for the connection to it. The value of an option comes from
// the command line, else from the option's environment variable, else from a named context. For run.h and Context.
// Functions without state.
#ifndef LOCUS_CLIENT_CLI_CONNECTION_OPTIONS_H_
#define LOCUS_CLIENT_CLI_CONNECTION_OPTIONS_H_

#include <string>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "client/lib/environment.h"

namespace locus::cli {

struct ConnectionOptions : client::Endpoint {
  std::string context = {};  // name of the context; empty = the default one, if no address is given
};

// Names of the options that add_connection_options() adds.
inline constexpr const char* kConnectionOptionNames[] = {"--address", "--context", "--tls",         "--ca",
                                                         "--cert",    "--key",     "--server-name", "--token-file"};

// Adds the options to the parser, with their environment variables.
void add_connection_options(CLI::App& app, ConnectionOptions& options);

// Fills in the options that neither the command line nor the environment gives. Their values come from the named
// context or, if no address is given, from the default context. `app` has parsed the line; `path` is the contexts file.
// Returns NOT_FOUND for an unknown context, and the errors of client::read_contexts().
absl::Status complete_from_context(const CLI::App& app, const std::string& path, ConnectionOptions& options);

// Returns the scene of the context that complete_from_context() would use; empty if there is no such context or if it
// names no scene. Errors are left to complete_from_context().
std::string scene_from_context(const CLI::App& app, const std::string& path, const ConnectionOptions& options);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_CONNECTION_OPTIONS_H_
