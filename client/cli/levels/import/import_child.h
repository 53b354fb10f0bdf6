// Child process that reads untrusted bytes, with limited memory, time and files, and with a filter of system calls. The
// child is a fork of the calling process, so its memory already contains the bytes to read. It returns its answer
// through a pipe. The child cannot change the memory of the caller, and the caller does not trust the child's answer.
// Used by import_file(). Thread-safe. README.md explains why a fork without exec is enough.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_CHILD_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_CHILD_H_

#include <cstdint>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "client/cli/levels/import/import_limits.h"

namespace locus::cli {

struct ChildLimits {
  uint64_t memory_bytes = kImportMemoryBase;  // address space beyond the caller's; unlimited in sanitizer builds
  uint32_t seconds = kMaxImportSeconds;
  uint32_t cpu_seconds = kMaxImportCpuSeconds;
};

// Returns the limits for a file of this size.
ChildLimits limits_for(uint64_t file_bytes);

struct ChildAnswer {
  std::string bytes;
  bool filtered = false;  // the child ran with the filter of system calls
};

// Calls `produce` in a child process and returns its result. `what` is the name of the file in error messages. Returns
// INVALID_ARGUMENT if the child crashed, made a forbidden system call, threw an exception, or sent no answer. Returns
// RESOURCE_EXHAUSTED if the child exceeded a limit, which the message names, or if no process with these limits can be
// started. When this function returns, the child has ended and is reaped. `produce` must not use threads or locks of
// the caller and must not read files. The child can be killed at any point of `produce`, without running destructors.
absl::StatusOr<ChildAnswer> run_in_child(absl::string_view what, const ChildLimits& limits,
                                         absl::FunctionRef<std::string()> produce);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_IMPORT_CHILD_H_
