#include "client/lib/connection.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "grpcpp/support/channel_arguments.h"

namespace locus::client {
namespace {

constexpr char kDefaultPort[] = ":7575";

bool is_local(absl::string_view target) {
  return absl::StartsWith(target, "127.") || absl::StartsWith(target, "localhost") ||
         absl::StartsWith(target, "[::1]") || absl::StartsWith(target, "unix:");
}

absl::Status nothing_answers(const std::string& target, absl::string_view detail) {
  return absl::UnavailableError(
      absl::StrCat("nothing answers at ", target, detail, ": start locusd there, or give its address"));
}

}  // namespace

absl::StatusOr<std::string> target_of(absl::string_view address) {
  if (address.empty()) return absl::InvalidArgumentError("the address is empty: give host:port or unix:/path");
  if (absl::StartsWith(address, "unix:")) return std::string(address);
  const bool bracketed = absl::StartsWith(address, "[");
  const bool has_port = bracketed ? !absl::EndsWith(address, "]") : std::count(address.begin(), address.end(), ':') > 0;
  return has_port ? std::string(address) : absl::StrCat(address, kDefaultPort);
}

std::shared_ptr<grpc::Channel> open_channel(const std::string& target, const ClientOptions& options) {
  constexpr int kFirstReconnectMs = 100;
  constexpr int kMaxReconnectMs = 2000;
  grpc::ChannelArguments arguments;
  arguments.SetMaxSendMessageSize(options.max_send_bytes);
  arguments.SetMaxReceiveMessageSize(options.max_receive_bytes);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kFirstReconnectMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kMaxReconnectMs);
  // Ignores the proxy that environment variables may name: it cannot reach this machine's loopback interface.
  if (is_local(target)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return grpc::CreateCustomChannel(target, grpc::InsecureChannelCredentials(), arguments);
}

absl::Status await_connection(grpc::Channel& channel, const std::string& target, const ClientOptions& options) {
  const absl::Time deadline = absl::Now() + options.connect_timeout;
  grpc_connectivity_state state = channel.GetState(/*try_to_connect=*/true);
  while (state != GRPC_CHANNEL_READY) {
    if (state == GRPC_CHANNEL_TRANSIENT_FAILURE && !options.wait_for_server) return nothing_answers(target, "");
    if (!channel.WaitForStateChange(state, absl::ToChronoTime(deadline))) {
      return nothing_answers(target, absl::StrCat(" within ", absl::FormatDuration(options.connect_timeout)));
    }
    state = channel.GetState(/*try_to_connect=*/true);
  }
  return absl::OkStatus();
}

}  // namespace locus::client
