// Scratch scenes of `locus tune`: copies of a scene, each with another cell size. They have random names, labels that
// say what they are, no history and no durability, and are deleted by the destructor. If the process is killed, the
// server deletes them after ten minutes without use. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_SCRATCH_SCENES_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_SCRATCH_SCENES_H_

#include <cstdint>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/extras/tune/object_batches.h"
#include "client/lib/client.h"

namespace locus::cli {

struct ScratchScene {
  std::string name;
  double cell_size = 0;  // the size that applies
  double build_ms = 0;   // time of the inserts, as the client measured it
  uint64_t bytes = 0;    // memory of the objects' structure
};

class ScratchScenes {
 public:
  // `work` makes the calls that may be cancelled, `cleaner` the deletions, which must not be. Borrows both. `scene` is
  // the scene to copy.
  ScratchScenes(const client::Client& work, const client::Client& cleaner, const v1::Scene& scene);
  ~ScratchScenes();
  ScratchScenes(const ScratchScenes&) = delete;
  ScratchScenes& operator=(const ScratchScenes&) = delete;

  // Makes a scene with the instances of the scene, the objects of `objects` and this SceneSpec.cell_size.
  absl::StatusOr<ScratchScene> make(double cell_size, const ObjectBatches& objects);
  // Deletes one of the scenes. A scene that cannot be deleted is tried again by the destructor.
  absl::Status remove(const std::string& name);

 private:
  absl::Status fill(const std::string& name, const ObjectBatches& objects, ScratchScene& scratch) const;

  const client::Client& work_;
  const client::Client& cleaner_;
  const v1::Scene source_;
  const std::string prefix_;  // of the names, ends with "-"
  uint64_t made_ = 0;
  std::set<std::string> names_;  // the scenes that may exist
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_SCRATCH_SCENES_H_
