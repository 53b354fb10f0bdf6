// Lists the value and the origin of each option of the daemon, without starting the daemon. The list shows operators
// why a daemon behaves as it does. Functions without state; any thread.
#ifndef LOCUS_SERVER_CONFIG_CONFIG_ORIGINS_H_
#define LOCUS_SERVER_CONFIG_CONFIG_ORIGINS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/config/server_config.h"

namespace locus::server {

enum class Origin : uint8_t { kFlag, kEnvironment, kFile, kDefault };
// Returns "flag", "environment", "file" or "default".
const char* origin_name(Origin origin);

struct ConfigValue {
  std::string name;   // name of the option, without dashes
  std::string value;  // value in use; for a default that depends on the machine, the computed value
  Origin origin = Origin::kDefault;
  std::string place;  // where the value is set: the flag, the variable, or path:line of the file; empty for a default
};

// Returns every option, in the order of the help. `arguments` are those of the command line, without the program's
// name. If the daemon would refuse to run, returns INVALID_ARGUMENT with the text that the daemon would print.
absl::StatusOr<std::vector<ConfigValue>> config_origins(const std::vector<std::string>& arguments,
                                                        const Environment& environment);

// Returns every option, in the order of the help, with its value in `config`, which must be the result of
// read_invocation() for `arguments` and `environment`. Ignores a command among the arguments, such as `config`.
std::vector<ConfigValue> config_values(const std::vector<std::string>& arguments, const Environment& environment,
                                       const ServerConfig& config);

// Returns `values` as a table with one option a line or, if `json` is true, as the JSON object
// {"options": [{"option", "value", "origin", "place"}]}.
std::string print_config(const std::vector<ConfigValue>& values, bool json);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_CONFIG_ORIGINS_H_
