// Address and credentials of a server, read from the environment and from named contexts by the rules of the command
// line.
//
//   auto endpoint = locus::client::endpoint_from_environment();
//   if (!endpoint.ok()) return endpoint.status();
//   auto client = locus::client::Client::connect(endpoint->address, {.credentials = endpoint->credentials});
//
// For programs that are configured like `locus`. Functions read the environment, so no other thread may change it at
// the same time.
#ifndef LOCUS_CLIENT_LIB_ENVIRONMENT_H_
#define LOCUS_CLIENT_LIB_ENVIRONMENT_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/lib/client.h"
#include "client/lib/options.h"

namespace locus::client {

struct Endpoint {
  std::string address = kDefaultAddress;
  CredentialOptions credentials = {};
};

// Returns the endpoint that the variables LOCUS_ADDRESS, LOCUS_TLS, LOCUS_CA, LOCUS_CERT, LOCUS_KEY, LOCUS_SERVER_NAME,
// LOCUS_TOKEN_FILE and LOCUS_TOKEN describe. Options that are not set by these variables come from a named context. Its
// name is `context`, or the value of LOCUS_CONTEXT if `context` is empty. If both are empty and LOCUS_ADDRESS is not
// set, the user's default context is used. If LOCUS_ADDRESS is set, the default context is not used, so that its
// credentials do not reach another server. Returns NOT_FOUND for an unknown context, INVALID_ARGUMENT for a malformed
// or too large contexts file or a malformed value of LOCUS_TLS, and FAILED_PRECONDITION for a contexts file that cannot
// be read. Client::connect() reads the files that contain credentials.
absl::StatusOr<Endpoint> endpoint_from_environment(const std::string& context = {});

// Options that the caller of complete_endpoint() has set already.
struct GivenOptions {
  bool address = false;
  bool tls = false;
};

// Fills in the members of `endpoint` that are not set: the address and `tls` unless they are `given`; the certificate
// and its key if both are empty; the token file if there is neither a token file nor a token; the CA file and the
// server name if they are empty. The values come from the context `context` of the file `contexts_path`. If `context`
// is empty, they come from the file's default context; then nothing is filled in if the address is `given`. If
// `endpoint` has both a token and a token file, drops the token. Returns NOT_FOUND for an unknown context, and the
// errors of read_contexts().
absl::Status complete_endpoint(const std::string& contexts_path, const std::string& context, GivenOptions given,
                               Endpoint& endpoint);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_ENVIRONMENT_H_
