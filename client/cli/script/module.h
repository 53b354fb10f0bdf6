// The module `locus` of scripts: commands, servers, scenes, batches, streams and expectations. The functions of one
// server, which take and return tables in the form of the protocol, are in C++; module.lua adds scenes, batches by row
// and expectations in Lua.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_MODULE_H_
#define LOCUS_CLIENT_CLI_SCRIPT_MODULE_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "client/cli/context.h"
#include "client/cli/script/sandbox.h"

namespace locus::cli {

enum class AfterFailure { kStop, kGoOn };

struct ScriptCounts {
  uint64_t passed = 0;  // expectations that were met
  uint64_t failed = 0;
};

// State of the module in one sandbox. Not thread-safe.
class ScriptModule {
 public:
  // Makes the module available in `sandbox` as the global `locus` and by require. Borrows both. An expectation that is
  // not met raises an error with kStop; with kGoOn its error is written to the context's error stream.
  ScriptModule(Sandbox& sandbox, Context& context, AfterFailure after);
  ScriptModule(const ScriptModule&) = delete;
  ScriptModule& operator=(const ScriptModule&) = delete;

  Sandbox& sandbox() { return sandbox_; }
  Context& context() { return context_; }
  const ScriptCounts& counts() const { return counts_; }

  // Prints and removes all values on the stack of the sandbox: tables in the format of -o, others as texts.
  absl::Status print_results();

  // Counts an expectation. Returns the error to raise if the expectation failed and the script stops; `error` has the
  // place of the expectation.
  absl::Status count(const absl::Status& error);

 private:
  Sandbox& sandbox_;
  Context& context_;
  const AfterFailure after_;
  ScriptCounts counts_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_MODULE_H_
