// EngineRows of scenes and meshes in PostgreSQL, and their checksums, which detect a changed or exchanged row.
// FORMAT.md describes the columns. Free functions on plain data; any thread.
#ifndef LOCUS_SERVER_STORAGE_POSTGRES_ROWS_H_
#define LOCUS_SERVER_STORAGE_POSTGRES_ROWS_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "core/scene/log/update_log.h"
#include "server/storage/postgres/engine_connection.h"
#include "server/storage/rows/checksums.h"

namespace locus::server {

// The part of a scene that appends do not change.
struct StoredSceneRow {
  SceneKey key = 0;
  std::string name;
  std::string spec;
  uint64_t epoch = 0;
  uint64_t apply_version = 0;
  uint64_t snapshot = 0;           // random id of the snapshot
  uint64_t snapshot_sequence = 0;  // sequence number of the last record whose effect is in the snapshot
  uint64_t snapshot_chain = 0;     // running checksum after that record
  ChunkList chunks;                // summary of the snapshot's chunks
};

struct StoredMeshRow {
  std::string name;
  Sha256 sha256 = {};
  uint32_t grace_s = 0;
  uint64_t content = 0;  // random id of the chunks of the parts
  ChunkList chunks;      // summary of these chunks
};

// Columns of `locus.scene s` and `locus.mesh m` in the order in which the next functions read them.
#define LOCUS_SCENE_COLUMNS                                                                                       \
  "s.key, s.name, s.spec, s.epoch, s.apply_version, s.snapshot, s.snapshot_sequence, s.snapshot_chain, s.chunks," \
  " s.chunk_bytes, s.digest, s.checksum"
#define LOCUS_MESH_COLUMNS "m.name, m.sha256, m.grace_s, m.content, m.chunks, m.chunk_bytes, m.digest, m.checksum"
inline constexpr int kSceneColumns = 12;
// Begins a statement that returns the columns which stored_scene() reads, and then chain, leader and token.
#define LOCUS_STORED_SCENES                                                               \
  "SELECT " LOCUS_SCENE_COLUMNS                                                           \
  ", l.last, (SELECT coalesce(sum(octet_length(r.bytes)), 0)::bigint FROM locus.record r" \
  " WHERE r.scene = s.key), l.chain, l.leader, l.token FROM locus.scene s JOIN locus.scene_log l ON l.scene = s.key "

// Returns DATA_LOSS for the scene or mesh `name`; `kind` is "scene" or "mesh".
absl::Status damaged(absl::string_view kind, absl::string_view name, absl::string_view what);

// Decode one row. DATA_LOSS, with the name, if its checksum is wrong.
absl::StatusOr<StoredSceneRow> scene_row(const EngineRows& rows, size_t row);
absl::StatusOr<StoredMeshRow> mesh_row(const EngineRows& rows, size_t row);

// Decode one row for the users of the log. A damaged row has its key and name, and `damage`.
StoredScene stored_scene(const EngineRows& rows, size_t row);
StoredMesh stored_mesh(const EngineRows& rows, size_t row);

uint64_t checksum_of(const StoredSceneRow& row);
uint64_t checksum_of(const StoredMeshRow& row);

// Returns the running checksum before a scene's first record.
uint64_t first_chain(SceneKey scene);
// Returns the running checksum after `entry`.
uint64_t chain_after(SceneKey scene, uint64_t sequence, const LogEntry& entry, uint64_t chain_before);
// Returns the checksum of the chunk `number` of the snapshot or mesh content `id`.
uint64_t chunk_checksum(uint64_t id, uint64_t number, absl::string_view bytes);

// Returns a random id for the chunks of a snapshot or mesh.
uint64_t random_id();

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_POSTGRES_ROWS_H_
