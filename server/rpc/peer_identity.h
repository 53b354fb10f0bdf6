// Name and expiry time in the certificate of a call's client. Functions without state; any thread.
#ifndef LOCUS_SERVER_RPC_PEER_IDENTITY_H_
#define LOCUS_SERVER_RPC_PEER_IDENTITY_H_

#include <grpcpp/server_context.h>

#include <cstdint>
#include <optional>
#include <string>

namespace locus::server {

// Returns the name in the certificate that the caller has proved to own. The name is the first URI among the
// certificate's alternative names, or else the first DNS name, or else the common name of the certificate's subject.
// Returns nullopt if the caller has no certificate that was verified.
std::optional<std::string> certificate_name(const grpc::ServerContextBase& context);

// Returns the time in seconds since 1970 from which the caller's certificate is no longer valid; the largest int64_t if
// the caller has no certificate, and 0 if the certificate cannot be read.
int64_t peer_certificate_end(const grpc::ServerContextBase& context);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_PEER_IDENTITY_H_
