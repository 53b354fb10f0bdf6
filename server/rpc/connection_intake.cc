#include "server/rpc/connection_intake.h"

#include <dlfcn.h>
#include <grpcpp/server_posix.h>
#include <sys/socket.h>

#include <cerrno>
#include <utility>

#include "core/base/check.h"
#include "server/connections/checked_reads.h"

namespace locus::server {

ConnectionIntake::ConnectionIntake(grpc::ServerBuilder& builder, std::shared_ptr<grpc::ServerCredentials> credentials)
    : tcp_(builder.experimental().AddExternalConnectionAcceptor(
          grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, std::move(credentials))) {}

void ConnectionIntake::hand_over(int descriptor, const Connection& connection) {
  LOCUS_CHECK(server_ != nullptr);
  if (connection.peer().uid) return grpc::AddInsecureChannelFromFd(server_, descriptor);
  grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
  parameters.fd = descriptor;
  tcp_->HandleNewConnection(&parameters);
}

}  // namespace locus::server

// Replaces the function of the C library for the whole process, because gRPC 1.51 has no place between reading and
// parsing. A connection with refused bytes looks to gRPC as if the peer had reset it.
extern "C" __attribute__((visibility("default"))) ssize_t recvmsg(int descriptor, msghdr* message, int flags) {
  static const auto next = reinterpret_cast<decltype(&recvmsg)>(dlsym(RTLD_NEXT, "recvmsg"));
  const ssize_t count = next(descriptor, message, flags);
  if (count <= 0 || (flags & (MSG_PEEK | MSG_ERRQUEUE)) != 0) return count;
  if (locus::server::CheckedReads::accept(descriptor, *message, static_cast<size_t>(count))) return count;
  errno = ECONNRESET;
  return -1;
}
