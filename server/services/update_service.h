// UpdateService over the scenes of a host: an ApplyUpdates call has one batch, a StreamUpdates call has a stream of
// batches. Both kinds of calls are served on IO loops.
#ifndef LOCUS_SERVER_SERVICES_UPDATE_SERVICE_H_
#define LOCUS_SERVER_SERVICES_UPDATE_SERVICE_H_

#include <memory>

#include "locus/v1/update_service.grpc.pb.h"
#include "server/host/host.h"
#include "server/rpc/io_threads.h"

namespace locus::server {

class UpdateService final : public v1::UpdateService::WithRawMethod_ApplyUpdates<
                                v1::UpdateService::WithRawMethod_StreamUpdates<v1::UpdateService::Service>> {
 public:
  explicit UpdateService(Host& host);
  ~UpdateService() override;

  // Begins to accept calls. Call it once, after the server has started and before the IO threads start. The threads
  // must end before the service is destroyed.
  void listen(IoThreads& threads);

 private:
  struct Listeners;

  Host& host_;
  std::unique_ptr<Listeners> listeners_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_UPDATE_SERVICE_H_
