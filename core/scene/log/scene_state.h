// State of a scene at one revision, without the history. The state has a part that readers see and a part that only the
// writer uses. FrozenScene is written to the log as a snapshot; SceneState is the result of reading this snapshot. Also
// defines the limits of a chunk. Plain data.
#ifndef LOCUS_CORE_SCENE_LOG_SCENE_STATE_H_
#define LOCUS_CORE_SCENE_LOG_SCENE_STATE_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/limits.h"
#include "core/scene/objects/leases.h"
#include "core/scene/objects/object.h"
#include "core/scene/snapshot/scene_snapshot.h"
#include "core/scene/statics/static_set.h"
#include "core/scene/updates/writer_table.h"

namespace locus {

// State of a scene at one revision, the input of StateWriter. Holding a FrozenScene while the scene changes costs
// little memory, because `snapshot` shares memory with later revisions.
struct FrozenScene {
  SnapshotPtr snapshot;
  WriterTable writers;
  bool has_past = false;   // SceneWriter::has_past()
  uint64_t sequence = 0;   // sequence number of the last record whose effect is included
  uint64_t log_bytes = 0;  // value of SceneJournal::total_bytes() after that record
  LeaseTable leases;
};

// Decoded scene snapshot, the input of SceneWriter::restore().
struct SceneState {
  uint64_t epoch = 0;
  uint64_t revision = 0;
  uint64_t tick = 0;
  bool has_past = false;
  WriterTable writers;
  std::shared_ptr<const StaticSet> statics;
  double cell_size = 0;                           // cell size of the grid
  std::vector<CompoundPtr> compounds;             // owns the compounds of `objects`
  std::vector<std::vector<Object>> objects;       // one vector for each chunk read
  std::vector<std::pair<Id, uint64_t>> expiries;  // objects that expire, and the ticks that they have left
  struct StoredLease {
    uint64_t writer = 0;
    uint32_t lease_ms = 0;
    std::vector<Id> ids;
  };
  std::vector<StoredLease> leases;
};

// Maximum numbers of objects and instances in one chunk of a snapshot, for StateWriter and StateReader. The limits are
// part of the format: a later version may write smaller chunks, but must still read chunks of these sizes.
inline constexpr size_t kObjectsPerChunk = 8192;
// Maximum encoded size of an object in bytes: id, group, tag, layers, kind, position, rotation, size, radius, compound.
inline constexpr size_t kMaxBytesOfObject = 8 + 8 + 8 + 4 + 1 + 24 + 16 + 12 + 4 + 4;
// Maximum number of parts of all compounds in one chunk, and maximum encoded size of a part in bytes: the number of
// parts of its compound, kind, position, rotation, size, radius and layers.
inline constexpr size_t kPartsPerChunk = 16384;
inline constexpr size_t kMaxBytesOfPart = 1 + 1 + 12 + 16 + 12 + 4 + 4;
inline constexpr uint32_t kNoCompound = 0xFFFFFFFFu;  // number of the compound of an object of another kind
// Maximum number of expiries, or of objects of leases, in one chunk.
inline constexpr size_t kLifetimesPerChunk = 32768;
inline constexpr size_t kInstancesPerChunk = 4096;
// Maximum encoded size of an instance in bytes. Includes the content hash, the bounds and the name, with length and
// padding, of the instance's mesh, as if no other instance in the chunk used that mesh.
inline constexpr size_t kMaxBytesOfInstance =
    32 + 24 + 8 + limits::kMaxNameLength + 1 + 8 + 8 + 8 + 4 + 4 + 24 + 16 + 4;
// Maximum length in bytes of ItemError::field. The longest field that is written, inserts[65535].capsule.half_axes, has
// 32 bytes; the other bytes are a reserve.
inline constexpr size_t kMaxErrorField = 128;
inline constexpr size_t kMaxBytesOfError = 32 + kMaxErrorField;

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_SCENE_STATE_H_
