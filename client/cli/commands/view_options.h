// What of a scene a command reads, and at which revision. For commands that read whole scenes. Plain data and functions
// without state.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_VIEW_OPTIONS_H_
#define LOCUS_CLIENT_CLI_COMMANDS_VIEW_OPTIONS_H_

#include <optional>
#include <string>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "client/cli/arguments.h"
#include "client/cli/context.h"
#include "client/cli/rows/scene_rows.h"
#include "client/lib/client.h"

namespace locus::cli {

struct ViewOptions {
  bool objects = false;
  bool instances = false;
  std::optional<uint64_t> at_least;
  std::optional<uint64_t> exactly;
  Number64 epoch;
};

// --objects, --instances, --at-least, --exactly, --epoch.
void add_view_options(CLI::App& command, ViewOptions& options);

// Both flags mean everything, as none does.
Things things_of(const ViewOptions& options);

// Usage error for options that exclude each other.
absl::Status check(const ViewOptions& options);

// A request for everything in a scene; without options the revision is at least that of the context's own last change.
v1::DumpSceneRequest dump_request(const std::string& scene, const ViewOptions& options, const Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_VIEW_OPTIONS_H_
