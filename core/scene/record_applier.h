// Applies logged records to the state of a scene: at a restart, and at a server that follows the scene's leader. The
// result depends only on the record and on the state before it, so every server makes the same revision of it. Plain
// functions; one thread at a time for one writer.
#ifndef LOCUS_CORE_SCENE_RECORD_APPLIER_H_
#define LOCUS_CORE_SCENE_RECORD_APPLIER_H_

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "core/geometry/aabb.h"
#include "core/scene/log/record_codec.h"
#include "core/scene/scene_writer.h"

namespace locus {

// Function that returns the mesh of a key, never null. `bounds` are those that the record has for the mesh; null for
// records of an old data format.
using MeshOfRecord = std::function<std::shared_ptr<const StaticMesh>(const MeshKey& key, const Aabbf* bounds)>;

// Applies the content of one record, and sets the meshes of its placements. Returns the snapshot of the revision that
// the record makes; null if it makes none, because its batch was refused when it was logged or changed nothing, or if a
// replay defers snapshots. Returns DATA_LOSS if the record does not fit the state: it was valid when it was logged.
absl::StatusOr<SnapshotPtr> apply_record(SceneWriter& writer, Record::Content& content, const MeshOfRecord& find_mesh);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_RECORD_APPLIER_H_
