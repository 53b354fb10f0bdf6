// Makes scenes and meshes again from what a log has of them: the state of a snapshot, and after it every record,
// applied as it was before. DATA_LOSS names the scene or the mesh and says what is wrong with it; other errors are the
// log's.
//
// What has passed is not recorded: a scene that was made again can be asked about the past from its snapshot on.
// Plain functions; any thread, several scenes at a time.
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

// How many records of how many were applied; from time to time.
using RecoveryProgress = std::function<void(uint64_t applied, uint64_t of)>;

// The scene as it was when its last record was written, in the epoch that the log has of it. It goes on appending to
// `log`, which outlives it. `find_mesh` is asked for each mesh that was ever used since the snapshot: only those that
// still are used need to be there.
absl::StatusOr<ScenePtr> recover_scene(UpdateLog& log, const StoredScene& stored, const FindMesh& find_mesh,
                                       const RecoveryProgress& progress = nullptr);

struct RecoveredMesh {
  MeshPtr mesh;
  bool built = false;  // its tree; otherwise it was restored from the outline that the log kept
};

// Makes the content of a mesh again. It has the parts that stand with the content, which are those of format 1. Where
// the tree is built, the log is given its outline for the next time.
absl::StatusOr<RecoveredMesh> recover_mesh(UpdateLog& log, const StoredMesh& stored, const BvhOptions& options = {});

// Returns the mesh of a stored name with the parts of that name. `content` is what recover_mesh() made of any name of
// the same content, which the mesh shares.
absl::StatusOr<MeshPtr> recover_name(const UpdateLog& log, const StoredMesh& stored, const MeshPtr& content);

// Finds the meshes that `registry` restored from `log`; both outlive the function. Records of format 1 name a content
// only: they mean the lowest name that was written in format 1, which is in use and so never deleted before them.
FindMesh find_restored_meshes(const UpdateLog& log, const Registry& registry);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_RECOVERY_H_
