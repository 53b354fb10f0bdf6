// Server reflection (grpc.reflection.v1alpha): tells tools such as grpcurl the schema of this server. gRPC's own
// implementation is not used, because it is a synchronous service: gRPC would parse its messages before their memory is
// claimed. Functions without state; any thread.
#ifndef LOCUS_SERVER_SERVICES_REFLECTION_H_
#define LOCUS_SERVER_SERVICES_REFLECTION_H_

#include "server/host/host.h"
#include "server/rpc/blocking_method.h"

namespace locus::server {

// Returns the only method of the reflection service.
BlockingMethod reflection_method(Host& host);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_REFLECTION_H_
