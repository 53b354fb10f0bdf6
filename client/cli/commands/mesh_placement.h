// Placement of an imported or generated level: creates the scene if requested, uploads each mesh, and places one
// instance of each mesh. For the import and generate commands.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_MESH_PLACEMENT_H_
#define LOCUS_CLIENT_CLI_COMMANDS_MESH_PLACEMENT_H_

#include <optional>
#include <string>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "client/cli/arguments.h"
#include "client/cli/commands/scene_up.h"
#include "client/cli/context.h"
#include "client/cli/levels/import/imported_mesh.h"
#include "core/base/progress_writer.h"

namespace locus::cli {

struct PlacementOptions {
  std::string scene;
  bool create = false;
  std::string mesh;  // name of a single mesh, or prefix for the names of several; empty = the level's names
  Triple at;
  Number64 id;  // id of the first instance; other instances get the following ids; 0 = the server chooses
  std::vector<Number64> layers;
  std::vector<Number64> groups;
  std::optional<UpAxis> up = std::nullopt;  // upward axis of the level; none = that of its format
};

// Adds the options shared by the import and generate commands, except --scene, which each command adds itself.
void add_placement_options(CLI::App& command, PlacementOptions& options);

// Uploads all meshes, then places an instance of each mesh in one atomic change. The position of the instances is the
// level's recentre translation plus `at`. A scene that is created gets the upward axis of the level as its label; if an
// existing scene has another upward axis, writes a note. Uploads nothing if the scene does not exist, and deletes the
// meshes that it has uploaded if the server refuses to place them. Writes a report with a row per mesh. Shows its
// phases through `progress`, and hides it before it returns.
absl::Status upload_and_place(const PlacementOptions& options, const ImportedLevel& level, Context& context,
                              ProgressWriter& progress);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_MESH_PLACEMENT_H_
