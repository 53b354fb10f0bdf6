#include "tests/bench/serving/daemon.h"

#include <utility>

#include "client/lib/connection.h"
#include "core/base/status_macros.h"

namespace locus::bench::serving {

absl::StatusOr<std::unique_ptr<Daemon>> Daemon::start(const std::vector<std::string>& options,
                                                      const client::CredentialOptions& credentials) {
  ASSIGN_OR_RETURN(auto of_channels, client::channel_credentials(credentials));
  auto daemon = std::unique_ptr<Daemon>(new Daemon());
  RETURN_IF_ERROR(daemon->run("locusd", options));
  daemon->set_credentials(std::move(of_channels));
  client::ClientOptions client_options;
  client_options.credentials = credentials;
  ASSIGN_OR_RETURN(daemon->client_, client::Client::connect(daemon->address(), client_options));
  return daemon;
}

}  // namespace locus::bench::serving
