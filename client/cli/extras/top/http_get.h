// HTTP GET of one page, with a maximum size and a timeout. No other file of the product uses libcurl. The function has
// no state, but only one thread at a time may call it.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TOP_HTTP_GET_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TOP_HTTP_GET_H_

#include <chrono>
#include <cstddef>
#include <string>

#include "absl/status/statusor.h"
#include "client/lib/options.h"

namespace locus::cli {

inline constexpr size_t kMaxPageBytes = 16u << 20;

// Returns the body of the page `path` of the server `address` (host:port). Uses https if the credentials enable TLS,
// otherwise http. The server's certificate must belong to the server name of the credentials or, without one, to the
// host of `address`. Sends the token of the credentials, if there is one. Follows no redirection and uses no proxy.
// Returns UNAVAILABLE if the connection fails or there is no complete answer within `timeout`, UNAUTHENTICATED for HTTP
// status 401, PERMISSION_DENIED for 403, FAILED_PRECONDITION for any other status except 200, RESOURCE_EXHAUSTED for a
// body of more than kMaxPageBytes, INVALID_ARGUMENT for a malformed address, and the errors of
// client::Authorization::make().
absl::StatusOr<std::string> http_get(const std::string& address, const std::string& path,
                                     const client::CredentialOptions& credentials, std::chrono::milliseconds timeout);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TOP_HTTP_GET_H_
