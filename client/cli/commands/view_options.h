// Options that select objects, instances or both, and a revision. For commands that read a whole scene. Plain data and
// functions without state.
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

// Adds the options --objects and --instances, and those of add_revision_options().
void add_view_options(CLI::App& command, ViewOptions& options);
// Adds the options --at-least, --exactly and --epoch.
void add_revision_options(CLI::App& command, ViewOptions& options);

// Returns the kinds of things to read: only objects with --objects, only instances with --instances, and both if both
// options are given or neither is.
Things things_of(const ViewOptions& options);

// Returns a usage error if options exclude each other.
absl::Status check(const ViewOptions& options);

// Returns a request to dump the whole scene. Without --at-least and --exactly, the request requires at least the
// revision of the last change acknowledged through this context.
v1::DumpSceneRequest dump_request(const std::string& scene, const ViewOptions& options, const Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_VIEW_OPTIONS_H_
