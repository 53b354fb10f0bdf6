// Finds out why a server cannot listen on an address, before and after gRPC tries. gRPC itself reports only that it
// failed, and silently replaces a unix socket that another server is using. Functions without state; any thread.
#ifndef LOCUS_SERVER_RPC_LISTENING_H_
#define LOCUS_SERVER_RPC_LISTENING_H_

#include <string>

#include "absl/status/status.h"
#include "server/config/listen_address.h"

namespace locus::server {

// Returns ALREADY_EXISTS if another process accepts connections on this unix socket; OK for every TCP address.
absl::Status check_free(const ListenAddress& address);

// Tries to bind to the address and returns the system's reason for the failure, as text for people.
std::string why_not(const ListenAddress& address);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_LISTENING_H_
