// ServerService: version, features and limits of the server (GetServer), and a copy of its data directory (Backup).
// Threads: gRPC's synchronous threads, several calls at once.
#ifndef LOCUS_SERVER_SERVICES_SERVER_SERVICE_H_
#define LOCUS_SERVER_SERVICES_SERVER_SERVICE_H_

#include "locus/v1/server_service.grpc.pb.h"
#include "server/host/host.h"

namespace locus::server {

class ServerService final : public v1::ServerService::Service {
 public:
  explicit ServerService(Host& host) : host_(host) {}

  grpc::Status GetServer(grpc::ServerContext* context, const v1::GetServerRequest* request,
                         v1::GetServerResponse* response) override;
  grpc::Status Backup(grpc::ServerContext* context, const v1::BackupRequest* request,
                      grpc::ServerWriter<v1::BackupResponse>* writer) override;

 private:
  Host& host_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SERVER_SERVICE_H_
