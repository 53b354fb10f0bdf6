#include "server/rpc/connection_intake.h"

#include <grpcpp/server_posix.h>

#include <utility>

#include "core/base/check.h"

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
