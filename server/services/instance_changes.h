// ChangeInstances: changes of one scene run in the background, one after another in the order of their numbers; a
// caller waits for its own or goes on at once.
#ifndef LOCUS_SERVER_SERVICES_INSTANCE_CHANGES_H_
#define LOCUS_SERVER_SERVICES_INSTANCE_CHANGES_H_

#include "absl/status/status.h"
#include "locus/v1/scene_service.pb.h"
#include "server/rpc/call.h"

namespace locus::server {

absl::Status change_instances(Host& host, const Caller& caller, const v1::ChangeInstancesRequest& request,
                              v1::ChangeInstancesResponse* response);

// A scene with the changes that wait for it.
v1::Scene describe(const Host& host, const Scene& scene);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_INSTANCE_CHANGES_H_
