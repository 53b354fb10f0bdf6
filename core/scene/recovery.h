// Restores scenes and meshes from a log: reads the snapshot of a scene and replays every later record. DATA_LOSS names
// the damaged scene or mesh and describes the damage; other errors are the log's.
//
// History is not part of a snapshot: the history of a restored scene begins at its snapshot. Plain functions; any
// thread, several scenes at the same time.
#ifndef LOCUS_CORE_SCENE_RECOVERY_H_
#define LOCUS_CORE_SCENE_RECOVERY_H_

#include <cstdint>
#include <functional>

#include "absl/status/statusor.h"
#include "core/index/bvh/bvh_build.h"
#include "core/scene/log/state_reader.h"
#include "core/scene/log/update_log.h"
#include "core/scene/registry.h"

namespace locus {

// Called from time to time with the number of records applied so far and of all records.
using RecoveryProgress = std::function<void(uint64_t applied, uint64_t of)>;

// Returns the scene in the state after its last record, in the epoch of the log. It appends to `log`, which outlives
// it. `find_mesh` is called for each mesh that was used since the snapshot and may return null for meshes that no
// instance uses any more. O(snapshot + records).
absl::StatusOr<ScenePtr> recover_scene(UpdateLog& log, const StoredScene& stored, const FindMesh& find_mesh,
                                       const RecoveryProgress& progress = nullptr);

struct RecoveredMesh {
  MeshPtr mesh;
  bool built = false;  // true: the tree was built; false: it was restored from the cached topology
};

// Returns a stored mesh. If its tree must be built, stores the topology in the log's cache for the next recovery.
absl::StatusOr<RecoveredMesh> recover_mesh(UpdateLog& log, const StoredMesh& stored, const BvhOptions& options = {});

// Returns the mesh of a stored name with the parts of that name. `content` is what recover_mesh() made of any name of
// the same content, which the mesh shares.
absl::StatusOr<MeshPtr> recover_name(const UpdateLog& log, const StoredMesh& stored, const MeshPtr& content);

// Finds the meshes that `registry` restored from `log`; both outlive the function. Records of format 1 name a content
// only: they mean the lowest name that was written in format 1, which is in use and so never deleted before them.
FindMesh find_restored_meshes(const UpdateLog& log, const Registry& registry);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_RECOVERY_H_
