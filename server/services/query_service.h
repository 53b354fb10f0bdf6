// QueryService over the scenes of a host: one batch a call, or a stream of them. Both live on IO loops.
#ifndef LOCUS_SERVER_SERVICES_QUERY_SERVICE_H_
#define LOCUS_SERVER_SERVICES_QUERY_SERVICE_H_

#include <memory>

#include "locus/v1/query_service.grpc.pb.h"
#include "server/host/host.h"
#include "server/rpc/io_threads.h"

namespace locus::server {

class QueryService final : public v1::QueryService::WithRawMethod_Query<
                               v1::QueryService::WithRawMethod_StreamQueries<v1::QueryService::Service>> {
 public:
  explicit QueryService(Host& host);
  ~QueryService() override;

  // Once, after the server started and before the IO threads do. They end before the service.
  void listen(IoThreads& threads);

 private:
  struct Listeners;

  Host& host_;
  std::unique_ptr<Listeners> listeners_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_QUERY_SERVICE_H_
