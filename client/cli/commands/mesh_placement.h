// From an imported or generated level to instances in a scene: creates the scene if asked, uploads each mesh, places
// one instance of each. For the import and generate commands.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_MESH_PLACEMENT_H_
#define LOCUS_CLIENT_CLI_COMMANDS_MESH_PLACEMENT_H_

#include <string>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "client/cli/arguments.h"
#include "client/cli/context.h"
#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

struct PlacementOptions {
  std::string scene;
  bool create = false;
  std::string mesh;  // name to upload under; empty = the level's own
  Triple at;
  Number64 id;  // of the first instance, the next ones count up; 0 = the server chooses
  std::vector<Number64> layers;
  std::vector<Number64> groups;
};

// The options of both commands but --scene.
void add_placement_options(CLI::App& command, PlacementOptions& options);

// One atomic change places all meshes, each at the level's recentre translation plus `at`. Writes a row a mesh.
// Progress goes to the context's error stream if that is live.
absl::Status upload_and_place(const PlacementOptions& options, const ImportedLevel& level, Context& context);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_MESH_PLACEMENT_H_
