// Connections to the servers of a cluster, opened by their addresses. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_OPEN_CLUSTER_H_
#define LOCUS_CLIENT_LIB_OPEN_CLUSTER_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/lib/options.h"
#include "client/lib/router.h"

namespace locus::client {

// Opens the connections and waits until one of them is established; the errors are those of Client::connect_cluster().
absl::StatusOr<std::shared_ptr<Router>> open_cluster(const std::vector<std::string>& addresses,
                                                     const ClientOptions& options);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_OPEN_CLUSTER_H_
