// Address of the engine: the hosts of a replicated PostgreSQL, of which one at a time accepts writes, and the settings
// of connections as libpq has them (user, password file, TLS). Immutable; any thread.
#ifndef LOCUS_SERVER_STORAGE_POSTGRES_ENGINE_ADDRESS_H_
#define LOCUS_SERVER_STORAGE_POSTGRES_ENGINE_ADDRESS_H_

#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::server {

class EngineAddress {
 public:
  using Settings = std::vector<std::pair<std::string, std::string>>;  // keywords of libpq and their values

  // Parses postgresql://[user@]host[:port],.../database[?setting=value&...]. INVALID_ARGUMENT if libpq cannot parse
  // `url`, or if it contains a password: command lines are visible to other users of the machine, so passwords belong
  // into the file that the setting `passfile` or PGPASSFILE names. No error contains the text of `url`.
  static absl::StatusOr<EngineAddress> parse(absl::string_view url);

  size_t host_count() const { return hosts_.size(); }
  // Returns host and port as text, for messages.
  std::string host_name(size_t host) const;
  // Returns the settings of a connection to one host.
  Settings settings_of(size_t host) const;

 private:
  struct Host {
    std::string name, port;
  };

  std::vector<Host> hosts_;
  Settings shared_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_POSTGRES_ENGINE_ADDRESS_H_
