// QueryService over the scenes of a host: one batch a call, or a stream of them. A batch is answered on the caller's
// thread with the help of the host's pool.
#ifndef LOCUS_SERVER_SERVICE_QUERY_SERVICE_H_
#define LOCUS_SERVER_SERVICE_QUERY_SERVICE_H_

#include "locus/v1/query_service.grpc.pb.h"
#include "server/service/blocking_stream.h"
#include "server/service/host.h"

namespace locus::server {

class QueryService final : public v1::QueryService::WithRawCallbackMethod_StreamQueries<v1::QueryService::Service> {
 public:
  explicit QueryService(Host& host) : host_(host) {}

  grpc::Status Query(grpc::ServerContext* context, const v1::QueryRequest* request,
                     v1::QueryResponse* response) override;

  using WithRawCallbackMethod_StreamQueries::StreamQueries;
  RawReactor* StreamQueries(grpc::CallbackServerContext* context) override;

 private:
  Host& host_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICE_QUERY_SERVICE_H_
