// Hands accepted connections over to gRPC. TCP connections go through gRPC's external acceptor, which supports TLS and
// names each peer by its address. The external acceptor would give all peers of unix sockets the same name. Therefore
// unix connections are added by their file descriptors, and each peer's name contains the descriptor.
//
// Threads: hand_over() on one thread, between started() and the shutdown of the server.
#ifndef LOCUS_SERVER_RPC_CONNECTION_INTAKE_H_
#define LOCUS_SERVER_RPC_CONNECTION_INTAKE_H_

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <memory>

#include "server/connections/connection.h"

namespace locus::server {

class ConnectionIntake {
 public:
  // Adds the external acceptor to `builder`. TCP connections use `credentials`.
  ConnectionIntake(grpc::ServerBuilder& builder, std::shared_ptr<grpc::ServerCredentials> credentials);

  // Sets the server that was built, which must outlive the last hand_over().
  void started(grpc::Server& server) { server_ = &server; }

  // Gives gRPC the descriptor of a connection.
  void hand_over(int descriptor, const Connection& connection);

 private:
  const std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> tcp_;
  grpc::Server* server_ = nullptr;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_CONNECTION_INTAKE_H_
