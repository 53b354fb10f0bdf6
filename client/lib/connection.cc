#include "client/lib/connection.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/lib/advice.h"
#include "client/lib/pem_file.h"
#include "core/base/status_macros.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "grpcpp/client_context.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "grpcpp/support/channel_arguments.h"

namespace locus::client {
namespace {

constexpr char kDefaultPort[] = ":7575";

void add_scene(grpc::ClientContext& context, absl::string_view scene) {
  constexpr size_t kMaxSceneName = 63;
  // gRPC aborts on other characters. The server refuses the names that are printable, but not names of scenes.
  const bool legal = !scene.empty() && scene.size() <= kMaxSceneName &&
                     std::all_of(scene.begin(), scene.end(), [](unsigned char c) { return absl::ascii_isgraph(c); });
  if (legal) context.AddMetadata("x-scene", std::string(scene));
}

// Returns the error of a channel that does not connect. gRPC reports the cause only in the status of a call, so this
// function makes a call. The call fails immediately if the channel's last attempt to connect has failed. `detail`
// follows the target in the error message.
absl::Status failure_of(const std::shared_ptr<grpc::ChannelInterface>& channel, const std::string& target,
                        absl::string_view detail) {
  constexpr absl::Duration kMaxWait = absl::Milliseconds(200);
  grpc::ClientContext context;
  context.set_deadline(absl::ToChronoTime(absl::Now() + kMaxWait));
  grpc::health::v1::HealthCheckResponse unused;
  const grpc::Status status = grpc::health::v1::Health::NewStub(channel)->Check(&context, {}, &unused);
  if (const std::string advice = advice_on_connection(status.error_message()); !advice.empty())
    return absl::UnavailableError(absl::StrCat("no connection to ", target, ": ", advice));
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

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> channel_credentials(const CredentialOptions& options) {
  if (options.certificate_file.empty() != options.key_file.empty())
    return absl::InvalidArgumentError("a client's certificate and its key belong together: give both or neither");
  if (!uses_tls(options)) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions files;
  if (!options.ca_file.empty()) {
    ASSIGN_OR_RETURN(files.pem_root_certs, read_small_file("ca_file", options.ca_file));
    RETURN_IF_ERROR(check_certificates(options.ca_file, files.pem_root_certs));
  }
  if (!options.certificate_file.empty()) {
    ASSIGN_OR_RETURN(files.pem_cert_chain, read_small_file("certificate_file", options.certificate_file));
    RETURN_IF_ERROR(check_certificates(options.certificate_file, files.pem_cert_chain));
    ASSIGN_OR_RETURN(files.pem_private_key, read_small_file("key_file", options.key_file));
    RETURN_IF_ERROR(check_key(options.key_file, files.pem_private_key, files.pem_cert_chain));
  }
  return grpc::SslCredentials(files);
}

std::shared_ptr<grpc::Channel> open_channel(const std::string& target, const ClientOptions& options,
                                            const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                                            ChannelUse use) {
  constexpr int kFirstReconnectMs = 100;
  constexpr int kMaxReconnectMs = 2000;
  grpc::ChannelArguments arguments;
  arguments.SetMaxSendMessageSize(options.max_send_bytes);
  arguments.SetMaxReceiveMessageSize(options.max_receive_bytes);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kFirstReconnectMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kMaxReconnectMs);
  if (use == ChannelUse::kMember) {
    constexpr int kMaxConnectingMs = 1000;
    constexpr int kPingEveryMs = 6000;  // servers accept a ping every 5 s
    constexpr int kPingAnswerMs = 2000;
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kMaxConnectingMs);
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kPingEveryMs);
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingAnswerMs);
    arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  }
  // Ignore a proxy set in the environment: a proxy on another machine cannot reach this machine's loopback interface.
  if (stays_on_this_machine(target)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const std::string& server_name = options.credentials.server_name;
  if (!server_name.empty()) arguments.SetSslTargetNameOverride(server_name);
  return grpc::CreateCustomChannel(target, credentials, arguments);
}

absl::Status await_connection(const std::shared_ptr<grpc::Channel>& channel, const std::string& target,
                              const ClientOptions& options) {
  const absl::Time deadline = absl::Now() + options.connect_timeout;
  grpc_connectivity_state state = channel->GetState(/*try_to_connect=*/true);
  while (state != GRPC_CHANNEL_READY) {
    if (state == GRPC_CHANNEL_TRANSIENT_FAILURE && !options.wait_for_server) return failure_of(channel, target, "");
    if (!channel->WaitForStateChange(state, absl::ToChronoTime(deadline))) {
      return failure_of(channel, target, absl::StrCat(" within ", absl::FormatDuration(options.connect_timeout)));
    }
    state = channel->GetState(/*try_to_connect=*/true);
  }
  return absl::OkStatus();
}

void continue_connecting(const Link& link, absl::Time deadline) {
  constexpr absl::Duration kMaxWait = absl::Milliseconds(100);
  if (link.gate != nullptr || link.channel->GetState(/*try_to_connect=*/false) != GRPC_CHANNEL_TRANSIENT_FAILURE)
    return;
  link.channel->WaitForStateChange(GRPC_CHANNEL_TRANSIENT_FAILURE,
                                   absl::ToChronoTime(std::min(absl::Now() + kMaxWait, deadline)));
}

void wait_connecting(const Link& link, absl::Duration duration) {
  if (link.gate != nullptr) return absl::SleepFor(duration);
  const absl::Time end = absl::Now() + duration;
  while (absl::Now() < end) {
    const grpc_connectivity_state state = link.channel->GetState(/*try_to_connect=*/true);
    if (state == GRPC_CHANNEL_READY) return absl::SleepFor(end - absl::Now());
    link.channel->WaitForStateChange(state, absl::ToChronoTime(end));
  }
}

uint64_t prepare(grpc::ClientContext& context, const CallHeader& header) {
  if (header.deadline != absl::InfiniteFuture()) context.set_deadline(absl::ToChronoTime(header.deadline));
  add_scene(context, header.scene);
  return header.authorization.add_to(context);
}

}  // namespace locus::client
