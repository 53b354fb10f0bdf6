// The static geometry (level) that `locus demo` uses. It is uploaded to a server and placed in a scene, and also kept
// in memory for checking answers.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_LEVEL_H_
#define LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_LEVEL_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/extras/demo/brute_force.h"
#include "client/cli/levels/import/imported_mesh.h"
#include "client/lib/client.h"
#include "core/base/progress_writer.h"

namespace locus::cli {

struct DemoLevel {
  std::vector<CheckedInstance> instances;
  Aabbd bounds;  // world bounds of all instances
  uint64_t triangles = 0;
};

// Returns `level` with its meshes placed as create_level() places them: mesh i becomes instance i + 1.
DemoLevel place_level(const ImportedLevel& level);

// Creates `scene` on the server and places the level's meshes in it. Deletes an existing scene of that name first.
// Shows the uploads through `progress`.
absl::Status create_level(const client::Client& client, const std::string& scene, const ImportedLevel& level,
                          ProgressWriter& progress);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_LEVEL_H_
