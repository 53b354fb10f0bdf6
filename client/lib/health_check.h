// One call of the standard health service. Internal to the library: Client::health is the door.
#ifndef LOCUS_CLIENT_LIB_HEALTH_CHECK_H_
#define LOCUS_CLIENT_LIB_HEALTH_CHECK_H_

#include <memory>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client/lib/client.h"

namespace locus::client {

// grpc.health.v1.Health/Check, a request and a response of one field each, read and written without a generated stub:
// Debian ships none. A status number that is not known becomes kUnknown. Blocks until the deadline at most.
absl::StatusOr<Health> check_health(const std::shared_ptr<grpc::ChannelInterface>& channel, absl::string_view service,
                                    absl::Time deadline);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_HEALTH_CHECK_H_
