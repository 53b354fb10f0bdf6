// QueryService over the scenes of a host: a Query call has one batch, a Step call an update and a batch, a
// StreamQueries call a stream of batches, each with or without an update. All calls are served on IO loops.
#ifndef LOCUS_SERVER_SERVICES_QUERY_SERVICE_H_
#define LOCUS_SERVER_SERVICES_QUERY_SERVICE_H_

#include <memory>

#include "locus/v1/query_service.grpc.pb.h"
#include "server/host/host.h"
#include "server/rpc/io_threads.h"

namespace locus::server {

class QueryService final : public v1::QueryService::WithRawMethod_Query<v1::QueryService::WithRawMethod_Step<
                               v1::QueryService::WithRawMethod_StreamQueries<v1::QueryService::Service>>> {
 public:
  explicit QueryService(Host& host);
  ~QueryService() override;

  // Begins to accept calls. Call it once, after the server has started and before the IO threads start. The threads
  // must end before the service is destroyed.
  void listen(IoThreads& threads);

 private:
  struct Listeners;

  Host& host_;
  std::unique_ptr<Listeners> listeners_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_QUERY_SERVICE_H_
