// Which options the daemon would run with, and where each value comes from, without running it: for people who ask why
// a daemon does what it does. Function without state.
#ifndef LOCUS_SERVER_CONFIG_CONFIG_ORIGINS_H_
#define LOCUS_SERVER_CONFIG_CONFIG_ORIGINS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/config/server_config.h"

namespace locus::server {

enum class Origin : uint8_t { kFlag, kEnvironment, kFile, kDefault };
// "flag", "environment", "file" or "default".
const char* origin_name(Origin origin);

struct ConfigValue {
  std::string name;   // of the option, without dashes
  std::string value;  // as used: where the default follows the machine, what it comes to here
  Origin origin = Origin::kDefault;
  std::string place;  // the flag, the variable, path:line, or empty
};

// Every option, in the order of the help. `arguments` as read_invocation() takes them; INVALID_ARGUMENT with the text
// that the daemon would end with.
absl::StatusOr<std::vector<ConfigValue>> config_origins(const std::vector<std::string>& arguments,
                                                        const Environment& environment);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_CONFIG_ORIGINS_H_
