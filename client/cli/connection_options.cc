#include "client/cli/connection_options.h"

#include "client/lib/saved_contexts.h"

namespace locus::cli {
void add_connection_options(CLI::App& app, ConnectionOptions& options) {
  app.add_option("-a,--address", options.address, "Where locusd listens: host:port or unix:/path")
      ->envname("LOCUS_ADDRESS")
      ->type_name("ADDRESS")
      ->capture_default_str();
  app.add_option("--context", options.context, "Use the connection options that `locus context` stored under this name")
      ->envname("LOCUS_CONTEXT")
      ->type_name("NAME");
  client::CredentialOptions& credentials = options.credentials;
  app.add_flag("--tls", credentials.tls, "Encrypt the connection; --ca, --cert and --server-name imply it")
      ->envname("LOCUS_TLS");
  app.add_option("--ca", credentials.ca_file, "Certificates of the server's authority [those this machine trusts]")
      ->envname("LOCUS_CA")
      ->type_name("FILE");
  app.add_option("--cert", credentials.certificate_file, "Certificate of this client, for mutual TLS")
      ->envname("LOCUS_CERT")
      ->type_name("FILE");
  app.add_option("--key", credentials.key_file, "Private key of --cert")->envname("LOCUS_KEY")->type_name("FILE");
  app.add_option("--server-name", credentials.server_name, "Name in the server's certificate [the host of --address]")
      ->envname("LOCUS_SERVER_NAME")
      ->type_name("NAME");
  app.add_option("--token-file", credentials.token_file, "File with the token to send; LOCUS_TOKEN is the token itself")
      ->envname("LOCUS_TOKEN_FILE")
      ->type_name("FILE");
}

absl::Status complete_from_context(const CLI::App& app, const std::string& path, ConnectionOptions& options) {
  const client::GivenOptions given{app.count("--address") > 0, app.count("--tls") > 0};
  return complete_endpoint(path, options.context, given, options);
}

std::string scene_from_context(const CLI::App& app, const std::string& path, const ConnectionOptions& options) {
  if (options.context.empty() && app.count("--address") > 0) return "";
  const absl::StatusOr<client::SavedContexts> contexts = client::read_contexts(path);
  if (!contexts.ok()) return "";
  const auto found = contexts->by_name.find(options.context.empty() ? contexts->default_name : options.context);
  return found == contexts->by_name.end() ? "" : found->second.scene;
}

}  // namespace locus::cli
