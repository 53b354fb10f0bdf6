// ServerService: version, features and limits of the server (GetServer), quotas and their use (GetQuotas), and a copy
// of the server's data directory (Backup). Functions without state; any thread.
#ifndef LOCUS_SERVER_SERVICES_SERVER_SERVICE_H_
#define LOCUS_SERVER_SERVICES_SERVER_SERVICE_H_

#include <vector>

#include "server/host/host.h"
#include "server/rpc/blocking_method.h"

namespace locus::server {

// Returns the methods of locus.v1.ServerService over `host`, which must outlive them.
std::vector<BlockingMethod> server_methods(Host& host);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SERVER_SERVICE_H_
