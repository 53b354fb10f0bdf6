// ChangeInstances: the changes of a scene run in the background, one after another in the order of their numbers. A
// caller waits for its change, or returns at once with its number. Functions without state; any thread.
#ifndef LOCUS_SERVER_SERVICES_INSTANCE_CHANGES_H_
#define LOCUS_SERVER_SERVICES_INSTANCE_CHANGES_H_

#include "absl/status/status.h"
#include "locus/v1/scene_service.pb.h"
#include "server/rpc/call.h"

namespace locus::server {

// Serves one ChangeInstances call. Blocks until the change is published, unless the request says no_wait.
absl::Status change_instances(Host& host, const Caller& caller, const v1::ChangeInstancesRequest& request,
                              v1::ChangeInstancesResponse* response);

// Returns the description of a scene, with the number of its pending changes. O(objects), because it computes the
// bounds of all objects.
v1::Scene describe(const Host& host, const Scene& scene);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_INSTANCE_CHANGES_H_
