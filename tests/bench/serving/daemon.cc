#include "tests/bench/serving/daemon.h"

namespace locus::bench::serving {

absl::StatusOr<std::unique_ptr<Daemon>> Daemon::start(const std::vector<std::string>& options) {
  auto daemon = std::unique_ptr<Daemon>(new Daemon());
  if (absl::Status status = daemon->run("locusd", options); !status.ok()) return status;
  auto client = client::Client::connect(daemon->address());
  if (!client.ok()) return client.status();
  daemon->client_ = *std::move(client);
  return daemon;
}

}  // namespace locus::bench::serving
