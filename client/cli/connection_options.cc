#include "client/cli/connection_options.h"

#include "client/cli/security/saved_contexts.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

void fill(std::string& value, const std::string& saved) {
  if (value.empty()) value = saved;
}

}  // namespace

void add_connection_options(CLI::App& app, ConnectionOptions& options) {
  app.add_option("-a,--address", options.address, "Where locusd listens: host:port or unix:/path")
      ->envname("LOCUS_ADDRESS")
      ->type_name("ADDRESS")
      ->capture_default_str();
  app.add_option("--context", options.context, "Use the connection options that `locus context` stored under this name")
      ->envname("LOCUS_CONTEXT")
      ->type_name("NAME");
  client::CredentialOptions& credentials = options.credentials;
  app.add_flag("--tls", credentials.tls, "Encrypt the connection; --ca and --cert imply it")->envname("LOCUS_TLS");
  app.add_option("--ca", credentials.ca_file, "Certificates of the server's authority [those this machine trusts]")
      ->envname("LOCUS_CA")
      ->type_name("FILE");
  app.add_option("--cert", credentials.certificate_file, "Certificate of this client, for mutual TLS")
      ->envname("LOCUS_CERT")
      ->type_name("FILE");
  app.add_option("--key", credentials.key_file, "Private key of --cert")->envname("LOCUS_KEY")->type_name("FILE");
  app.add_option("--token-file", credentials.token_file, "File with the token to send; LOCUS_TOKEN is the token itself")
      ->envname("LOCUS_TOKEN_FILE")
      ->type_name("FILE");
}

absl::Status complete_from_context(const CLI::App& app, const std::string& path, ConnectionOptions& options) {
  client::CredentialOptions& credentials = options.credentials;
  if (!credentials.token_file.empty()) credentials.token.clear();
  const bool has_address = app.count("--address") > 0;
  if (options.context.empty() && has_address) return absl::OkStatus();
  ASSIGN_OR_RETURN(const SavedContexts contexts, read_contexts(path));
  const std::string& name = options.context.empty() ? contexts.default_name : options.context;
  if (name.empty()) return absl::OkStatus();
  ASSIGN_OR_RETURN(const SavedContext saved, find_context(contexts, name));
  if (!has_address && !saved.address.empty()) options.address = saved.address;
  if (app.count("--tls") == 0) credentials.tls = saved.tls == "true";
  fill(credentials.ca_file, saved.ca);
  if (credentials.certificate_file.empty() && credentials.key_file.empty()) {
    credentials.certificate_file = saved.cert;
    credentials.key_file = saved.key;
  }
  if (credentials.token.empty()) fill(credentials.token_file, saved.token_file);
  return absl::OkStatus();
}

}  // namespace locus::cli
