// Finds the address of a server's HTTP port, from what the server says about it. A function without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TOP_METRICS_ADDRESS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TOP_METRICS_ADDRESS_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/lib/client.h"

namespace locus::cli {

// Returns host:port of the HTTP port of the server that listens on `address` (host:port, host or unix:/path) for gRPC.
// The host is that of `address`, or loopback for a unix socket, unless the HTTP port listens on another certain address
// of the machine. Returns FAILED_PRECONDITION if the server has no HTTP port.
absl::StatusOr<std::string> metrics_address(const std::string& address, const v1::GetServerResponse& server);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TOP_METRICS_ADDRESS_H_
