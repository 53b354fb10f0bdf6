// Restores scenes and meshes from a log: reads the snapshot of a scene and replays every later record. Returns
// DATA_LOSS, naming the scene or mesh and describing the damage, if stored data is damaged; all other errors come from
// the log.
//
// History is not part of a snapshot: the history of a restored scene begins at its snapshot. Any thread may call the
// functions; several scenes may be restored at the same time.
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

// Function that is called after every 64 records, and after the last record, with the number of records applied so far
// and the number of all records to apply.
using RecoveryProgress = std::function<void(uint64_t applied, uint64_t of)>;

// Use that a restored scene makes of the log from which it was read.
enum class LogUse : uint8_t {
  kAppend,    // it appends its changes
  kReadOnly,  // it is a scene without a log, whose changes are not stored
};

// Returns the scene in the state after its last record, in the epoch stored.epoch. The scene uses `log`, which outlives
// the scene, as `use` says. `find_mesh` is called for each mesh that the snapshot or a later record uses, and may
// return null for a mesh that no instance uses after the last record. O(snapshot + records).
absl::StatusOr<ScenePtr> recover_scene(UpdateLog& log, const StoredScene& stored, const FindMesh& find_mesh,
                                       const RecoveryProgress& progress = nullptr, LogUse use = LogUse::kAppend);

struct RecoveredMesh {
  MeshPtr mesh;
  bool built = false;  // true: the tree was built; false: it was restored from the cached topology
};

// Returns the mesh that is stored under stored.name, with its tree from the cached topology. If no usable topology is
// cached, builds the tree and stores the topology in the log's cache for the next recovery. Does not read the parts
// that are stored for the name; recover_name() reads them.
absl::StatusOr<RecoveredMesh> recover_mesh(UpdateLog& log, const StoredMesh& stored, const BvhOptions& options = {});

// Returns the mesh of the name stored.name, with the parts and the creator that are stored for this name. The mesh
// shares the bytes and the tree of `content`, which recover_mesh() returned for any name of the same content.
absl::StatusOr<MeshPtr> recover_name(const UpdateLog& log, const StoredMesh& stored, const MeshPtr& content);

// Returns a function that finds the meshes which `registry` restored from `log`; both outlive the function. Records
// of data format 1, the oldest format, identify a mesh only by its content hash. For such a record the function
// returns the mesh whose name sorts first among the names that were stored for this content in format 1. Every
// recovery makes the same choice for an existing instance, because a name cannot be deleted while instances use it.
FindMesh find_restored_meshes(const UpdateLog& log, const Registry& registry);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_RECOVERY_H_
