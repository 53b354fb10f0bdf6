// Functions that open a gRPC channel and report a wrong address at once, with a clear message. Internal to the library.
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

// Returns the gRPC target of `address`, to which it adds port 7575 if `address` has no port. Returns INVALID_ARGUMENT
// if `address` is empty.
absl::StatusOr<std::string> target_of(absl::string_view address);

// Returns a channel to `target`, which does not connect yet. Its connection is not shared with any other channel of
// this process, so that each channel of a client has its own socket.
std::shared_ptr<grpc::Channel> open_channel(const std::string& target, const ClientOptions& options);

// Waits until the channel is connected. Returns UNAVAILABLE naming `target` if the connection is refused (unless
// `wait_for_server`) or connect_timeout has passed.
absl::Status await_connection(grpc::Channel& channel, const std::string& target, const ClientOptions& options);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_CONNECTION_H_
