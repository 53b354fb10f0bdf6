#include "client/lib/open_cluster.h"

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "grpcpp/channel.h"

namespace locus::client {
namespace {

constexpr absl::Duration kPause = absl::Milliseconds(100);

absl::StatusOr<std::shared_ptr<const ServerLinks>> open_server(
    const std::string& target, const ClientOptions& options,
    const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
  ASSIGN_OR_RETURN(std::shared_ptr<Authorization> authorization, Authorization::make(options.credentials, target));
  const auto open = [&] { return Link{open_channel(target, options, credentials, ChannelUse::kMember)}; };
  return std::make_shared<const ServerLinks>(target, std::move(authorization), open(), open());
}

// Waits until one of the servers is connected.
absl::Status await_one(const Router& router, const std::vector<std::shared_ptr<grpc::Channel>>& channels,
                       const std::vector<std::string>& targets, const ClientOptions& options) {
  const absl::Time deadline = absl::Now() + options.connect_timeout;
  ClientOptions each = options;
  each.wait_for_server = false;
  while (true) {
    absl::Status last;
    bool silent = true;
    for (size_t i = 0; i < channels.size(); ++i) {
      each.connect_timeout = std::min(options.connect_timeout / 3, deadline - absl::Now());
      last = await_connection(channels[i], targets[i], each);
      if (last.ok()) return last;
      silent = silent && absl::StartsWith(last.message(), "nothing answers");
    }
    if (!options.wait_for_server || absl::Now() + kPause >= deadline) {
      return silent ? absl::UnavailableError(absl::StrCat("nothing answers at ", router.address(),
                                                          ": start locusd there, or give its address"))
                    : last;
    }
    absl::SleepFor(kPause);
  }
}

}  // namespace

absl::StatusOr<std::shared_ptr<Router>> open_cluster(const std::vector<std::string>& addresses,
                                                     const ClientOptions& options) {
  if (addresses.empty()) return absl::InvalidArgumentError("there is no address: give one or more");
  ASSIGN_OR_RETURN(const auto credentials, channel_credentials(options.credentials));
  std::vector<std::shared_ptr<const ServerLinks>> given;
  std::vector<std::shared_ptr<grpc::Channel>> channels;
  std::vector<std::string> targets;
  for (const std::string& address : addresses) {
    ASSIGN_OR_RETURN(std::string target, target_of(absl::StripAsciiWhitespace(address)));
    if (std::find(targets.begin(), targets.end(), target) != targets.end()) continue;
    ASSIGN_OR_RETURN(std::shared_ptr<const ServerLinks> server, open_server(target, options, credentials));
    channels.push_back(std::static_pointer_cast<grpc::Channel>(server->latency.channel));
    given.push_back(std::move(server));
    targets.push_back(std::move(target));
  }
  const auto open = [options, credentials](const std::string& target) {
    return open_server(target, options, credentials);
  };
  auto router = std::make_shared<Router>(std::move(given), open, options.cluster);
  RETURN_IF_ERROR(await_one(*router, channels, targets, options));
  return router;
}

}  // namespace locus::client
