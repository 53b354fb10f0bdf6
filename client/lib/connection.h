// Functions that open a gRPC channel and prepare the calls on it. await_connection() reports a wrong address or a
// failed TLS handshake with a clear message. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_CONNECTION_H_
#define LOCUS_CLIENT_LIB_CONNECTION_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client/lib/authorization.h"
#include "client/lib/call_gate.h"
#include "client/lib/options.h"
#include "client/lib/running_calls.h"

namespace grpc {
class Channel;
class ChannelCredentials;
class ChannelInterface;
class ClientContext;
}  // namespace grpc

namespace locus::client {

// Returns the gRPC target of `address`, to which it adds port 7575 if `address` has no port. Returns INVALID_ARGUMENT
// if `address` is empty.
absl::StatusOr<std::string> target_of(absl::string_view address);

// Returns the channel credentials for these options, after checking the files. Returns INVALID_ARGUMENT, NOT_FOUND or
// FAILED_PRECONDITION naming the file if a file is missing, unreadable or malformed, and INVALID_ARGUMENT if only one
// of certificate and key is given.
absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> channel_credentials(const CredentialOptions& options);

// Returns a channel to `target`. The channel does not connect yet. It shares its connection with no other channel of
// this process, so that each channel of a client has its own socket.
// `use`: a channel to a member of a cluster, whose machine may vanish without a word, gives up a server that does not
// answer pings.
enum class ChannelUse { kOnlyServer, kMember };
std::shared_ptr<grpc::Channel> open_channel(const std::string& target, const ClientOptions& options,
                                            const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                                            ChannelUse use = ChannelUse::kOnlyServer);

// Waits until the channel is connected. Returns UNAVAILABLE naming `target` if options.connect_timeout has passed, or
// if the connection is refused and options.wait_for_server is false. If a server answers but the TLS handshake fails,
// the message names the cause and a remedy.
absl::Status await_connection(const std::shared_ptr<grpc::Channel>& channel, const std::string& target,
                              const ClientOptions& options);

// Channel of a client.
struct Link {
  std::shared_ptr<grpc::ChannelInterface> channel;
  // Gate of the server, if it is in the same process; otherwise null. A channel in the process has no connection that
  // could break, and gRPC does not report its state.
  std::shared_ptr<CallGate> gate = nullptr;
};

// Waits before a call while the link's channel tries to connect again: at most 100 ms, and not beyond `deadline`.
// Returns immediately unless the channel's last attempt to connect has failed. gRPC continues an attempt to connect
// only while a thread waits inside gRPC, or every 5 s. Without this wait, calls could fail for 15 s after the server
// has returned, because calls on a failed channel return immediately.
void continue_connecting(const Link& link, absl::Time deadline);

// Waits for `duration`. A link that is not connected tries to connect during the wait.
void wait_connecting(const Link& link, absl::Duration duration);

// Parameters of a call that are not part of its request: gRPC sends them as metadata or as the call's deadline.
struct CallHeader {
  Authorization& authorization;
  absl::Time deadline = absl::InfiniteFuture();
  absl::string_view scene = {};     // empty = the call concerns no scene
  RunningCalls* running = nullptr;  // set of calls to which the call's context is added; null = none
};

// Prepares the context of a call: sets its deadline, and adds the metadata entries `authorization` and `x-scene`.
// Routers use `x-scene` to find the server of a scene. If the scene's name is invalid, `x-scene` is omitted: gRPC would
// abort the process for bytes that are illegal in metadata, whereas the server refuses the same name in the request
// with a helpful message. Returns the number of the token (see Authorization::add_to).
uint64_t prepare(grpc::ClientContext& context, const CallHeader& header);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_CONNECTION_H_
