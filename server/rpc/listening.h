// Why a server cannot listen somewhere, found out before and after gRPC tries: gRPC itself only says that it failed,
// and takes a unix socket away from a server that is using it.
#ifndef LOCUS_SERVER_RPC_LISTENING_H_
#define LOCUS_SERVER_RPC_LISTENING_H_

#include <string>

#include "absl/status/status.h"
#include "server/config/listen_address.h"

namespace locus::server {

// ALREADY_EXISTS when another process answers at this unix socket. OK for every TCP address.
absl::Status check_free(const ListenAddress& address);

// What the system says when asked to listen there, for people.
std::string why_not(const ListenAddress& address);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_LISTENING_H_
