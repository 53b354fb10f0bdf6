// Memory accounting of snapshots. Plain functions; any thread.
#ifndef LOCUS_CORE_SCENE_SNAPSHOT_SNAPSHOT_BYTES_H_
#define LOCUS_CORE_SCENE_SNAPSHOT_SNAPSHOT_BYTES_H_

#include <cstdint>

#include "core/scene/snapshot/scene_snapshot.h"

namespace locus {

// Returns the bytes that `held` holds and `later`, a later revision of the same scene, does not: objects, instances and
// history, but not meshes, which scenes share. Exact, except that it may overestimate the history across a restart of
// ticks. O(size of the difference).
uint64_t unshared_bytes(const SceneSnapshot& held, const SceneSnapshot& later);

// Returns the bytes of the snapshot without its history and meshes. O(objects).
uint64_t bytes_of(const SceneSnapshot& snapshot);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_SNAPSHOT_BYTES_H_
