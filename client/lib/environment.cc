#include "client/lib/environment.h"

#include <cstdlib>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/lib/saved_contexts.h"
#include "core/base/status_macros.h"

namespace locus::client {
namespace {

// Returns the value of a variable; an empty string if it is not set.
std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

void fill(std::string& value, const std::string& saved) {
  if (value.empty()) value = saved;
}

}  // namespace

absl::StatusOr<Endpoint> endpoint_from_environment(const std::string& context) {
  Endpoint endpoint;
  const std::string address = variable("LOCUS_ADDRESS"), tls = variable("LOCUS_TLS");
  if (!address.empty()) endpoint.address = address;
  CredentialOptions& credentials = endpoint.credentials;
  if (!tls.empty() && !absl::SimpleAtob(tls, &credentials.tls))
    return absl::InvalidArgumentError(absl::StrCat("LOCUS_TLS is true or false, not '", tls, "'"));
  credentials.ca_file = variable("LOCUS_CA");
  credentials.certificate_file = variable("LOCUS_CERT");
  credentials.key_file = variable("LOCUS_KEY");
  credentials.server_name = variable("LOCUS_SERVER_NAME");
  credentials.token_file = variable("LOCUS_TOKEN_FILE");
  credentials.token = variable("LOCUS_TOKEN");
  const std::string& name = context.empty() ? variable("LOCUS_CONTEXT") : context;
  RETURN_IF_ERROR(complete_endpoint(default_contexts_path(), name, {!address.empty(), !tls.empty()}, endpoint));
  return endpoint;
}

absl::Status complete_endpoint(const std::string& contexts_path, const std::string& context, GivenOptions given,
                               Endpoint& endpoint) {
  CredentialOptions& credentials = endpoint.credentials;
  if (!credentials.token_file.empty()) credentials.token.clear();
  if (context.empty() && given.address) return absl::OkStatus();
  ASSIGN_OR_RETURN(const SavedContexts contexts, read_contexts(contexts_path));
  const std::string& name = context.empty() ? contexts.default_name : context;
  if (name.empty()) return absl::OkStatus();
  ASSIGN_OR_RETURN(const SavedContext saved, find_context(contexts, name));
  if (!given.address && !saved.address.empty()) endpoint.address = saved.address;
  if (!given.tls) credentials.tls = saved.tls == "true";
  fill(credentials.ca_file, saved.ca);
  fill(credentials.server_name, saved.server_name);
  if (credentials.certificate_file.empty() && credentials.key_file.empty()) {
    credentials.certificate_file = saved.cert;
    credentials.key_file = saved.key;
  }
  if (credentials.token.empty()) fill(credentials.token_file, saved.token_file);
  return absl::OkStatus();
}

}  // namespace locus::client
