// Opening a gRPC channel so that a wrong address is told at once and in plain words. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_CONNECTION_H_
#define LOCUS_CLIENT_LIB_CONNECTION_H_

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/lib/options.h"

namespace grpc {
class Channel;
}

namespace locus::client {

// What gRPC is to connect to: `address` with the default port where it names none. INVALID_ARGUMENT if it is empty.
absl::StatusOr<std::string> target_of(absl::string_view address);

// A channel of its own connection to `target`, shared with no other channel of this process. Does not connect.
std::shared_ptr<grpc::Channel> open_channel(const std::string& target, const ClientOptions& options);

// Waits until the channel is connected. UNAVAILABLE naming `target` if it is refused (unless `wait_for_server`) or the
// time is up.
absl::Status await_connection(grpc::Channel& channel, const std::string& target, const ClientOptions& options);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_CONNECTION_H_
