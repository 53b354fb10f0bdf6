// What a snapshot keeps from being freed. Any thread.
#ifndef LOCUS_CORE_SCENE_SNAPSHOT_SNAPSHOT_BYTES_H_
#define LOCUS_CORE_SCENE_SNAPSHOT_SNAPSHOT_BYTES_H_

#include <cstdint>

#include "core/scene/snapshot/scene_snapshot.h"

namespace locus {

// Of what `held` holds and `later`, a later revision of the same scene, does not: objects, instances and the past, but
// not meshes, which scenes share. Exact but for the past across a restart of ticks, of which it may say too much.
// O(what differs).
uint64_t unshared_bytes(const SceneSnapshot& held, const SceneSnapshot& later);

// Of all that the snapshot holds but its past and its meshes. O(objects).
uint64_t bytes_of(const SceneSnapshot& snapshot);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_SNAPSHOT_BYTES_H_
