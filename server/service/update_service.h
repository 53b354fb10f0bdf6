// UpdateService over the scenes of a host: one batch a call, or a stream of them.
#ifndef LOCUS_SERVER_SERVICE_UPDATE_SERVICE_H_
#define LOCUS_SERVER_SERVICE_UPDATE_SERVICE_H_

#include "locus/v1/update_service.grpc.pb.h"
#include "server/service/blocking_stream.h"
#include "server/service/host.h"

namespace locus::server {

class UpdateService final : public v1::UpdateService::WithRawCallbackMethod_StreamUpdates<v1::UpdateService::Service> {
 public:
  explicit UpdateService(Host& host) : host_(host) {}

  grpc::Status ApplyUpdates(grpc::ServerContext* context, const v1::ApplyUpdatesRequest* request,
                            v1::ApplyUpdatesResponse* response) override;

  using WithRawCallbackMethod_StreamUpdates::StreamUpdates;
  RawReactor* StreamUpdates(grpc::CallbackServerContext* context) override;

 private:
  Host& host_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICE_UPDATE_SERVICE_H_
