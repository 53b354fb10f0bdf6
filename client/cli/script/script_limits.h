// Limits of a script. Plain data. The error for an exceeded limit contains the limit's value.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_SCRIPT_LIMITS_H_
#define LOCUS_CLIENT_CLI_SCRIPT_SCRIPT_LIMITS_H_

#include <cstddef>
#include <cstdint>

#include "absl/time/time.h"

namespace locus::cli {

inline constexpr size_t kMaxScriptBytes = size_t{16} << 20;

struct ScriptLimits {
  uint64_t instructions = 2'000'000'000;  // of Lua's virtual machine; 0 = no limit
  uint64_t memory_bytes = 256u << 20;     // allocated by Lua; 0 = no limit
  absl::Duration time = absl::Hours(1);   // since the script began; zero = no limit
  bool unsafe = false;                    // also offers the functions of Lua that reach beyond the script
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_SCRIPT_LIMITS_H_
