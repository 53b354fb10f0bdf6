// Format 6 of the keys and values in RocksDB; FORMAT.md in this folder describes every byte. Each value ends with a
// checksum over key and value, which reveals a value under a wrong key. Free functions on plain data; any thread.
//
// A mesh has a content (vertices and triangles), stored once for all names of equal content, and parts (named ranges of
// triangles), stored for each name. Snapshots, contents and parts are stored as chunks; a random content id in their
// keys identifies each list of chunks.
//
// Formats 1 to 5 can be read, too. The mesh rows of format 1 have no `parts`: the chunks of the content include the
// parts. In formats 1 and 2 no scene and no mesh has a creator. Up to format 3, no record moves instances (LSBI, see
// core/scene/log/FORMAT.md), and no record and no snapshot has the bounds of meshes (LSEC, LSEI). Up to format 4,
// no record and no snapshot has compounds, expiries, leases or batches of several messages (LSBX, LSBG, LSXH, LSWM,
// LSTC, LSTK, LSTE, LSTL), no specification has lifetimes (LSLS), and no mesh row has `grace_s`. Up to format 5, no
// specification has a cell size (LSZS). Opening a directory of an older format sets its format number to 6 and leaves
// all rows unchanged.
//
// Column families, the fields of their keys, and the value under each key (`scene` is a SceneKey, `id` a content id):
// meta      "format"; "catalogue"; 's' scene: a scene; 'm' name: a mesh; 'c' sha256: a mesh's content; 'p' scene id:
//           marks a snapshot's chunks as unfinished; 'q' sha256 id: marks a mesh's chunks as unfinished
// log       scene sequence: a record. Its checksum covers the checksum of the record before, and so depends on all
//           earlier records. Therefore a missing, exchanged or outdated record is detected.
// snapshot  scene id index: a chunk of a scene's snapshot
// mesh      sha256 id index: a chunk of the content, or of the parts of one name
//
// Content ids are never reused, because reads ignore range deletions: no key in a deleted range may be written again.
// Each family has an empty row with the key kFamilyMark, "\0", which sorts first. Database::flush_to_new_log() writes
// this row, because RocksDB flushes a family only if its memory table has a row.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_ROWS_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_ROWS_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include "core/scene/log/update_log.h"
#include "server/storage/rows/checksums.h"

namespace locus::server {

inline constexpr uint32_t kFormat = 6;
inline constexpr uint32_t kOldestFormat = 1;
inline constexpr absl::string_view kFormatKey = "format";
inline constexpr absl::string_view kCatalogueKey = "catalogue";
inline constexpr absl::string_view kFamilyMark("\0", 1);
inline constexpr char kSceneTag = 's';
inline constexpr char kMeshTag = 'm';
inline constexpr char kContentTag = 'c';
inline constexpr char kPendingSnapshotTag = 'p';
inline constexpr char kPendingMeshTag = 'q';

// Content id and summary of the chunks of a snapshot, of a mesh's content, or of the parts of one mesh name.
struct ContentRow {
  uint64_t content_id = 0;
  ChunkList chunks;
};

// Row of one mesh name: hash of the mesh's content, and the chunks of the name's parts.
struct MeshRow {
  Sha256 sha256 = {};
  std::optional<ContentRow> parts;  // no value in rows of format 1: the content's chunks include the parts
  uint32_t grace_s = 0;             // see UpdateLog::set_mesh_graces(); 0: not set
};

struct SceneRow {
  SceneKey key = 0;
  std::string name;
  std::string spec;
  uint64_t epoch = 0;
  uint64_t snapshot_sequence = 0;
  uint64_t running_checksum = 0;  // checksum of record snapshot_sequence, and seed of the next record's checksum
  uint64_t snapshot_id = 0;
  ChunkList snapshot;
};

// Summary of the catalogue: a generation, which each change increments, the next free scene key, and the sums of the
// checksums of all scene rows and of all mesh rows.
struct CatalogueRow {
  uint64_t generation = 0;
  SceneKey next_scene = 1;
  uint64_t scene_sum = 0;
  uint64_t mesh_sum = 0;
};

// Return the keys of rows, records and chunks.
std::string scene_key(SceneKey scene);
std::string mesh_key(absl::string_view name);
std::string content_key(const Sha256& sha256);
std::string pending_snapshot_key(SceneKey scene, uint64_t content_id);
std::string pending_mesh_key(const Sha256& sha256, uint64_t content_id);
// Returns the exclusive end of the range of keys that begin with `prefix`: the first key after all of them.
std::string end_of(std::string prefix);
std::string scene_prefix(SceneKey scene);
std::string snapshot_prefix(SceneKey scene, uint64_t content_id);
std::string mesh_prefix(const Sha256& sha256, uint64_t content_id);
// Returns the key of a chunk. `prefix` is the common prefix of the keys of all chunks of the snapshot or mesh.
std::string chunk_key(absl::string_view prefix, uint32_t index);

// Returns the stored form of a chunk or of a row in meta: `bytes`, then the checksum over key and bytes.
std::string with_checksum(absl::string_view key, absl::string_view bytes);
// Returns `value` without its checksum; no value if the checksum is wrong.
std::optional<absl::string_view> verified(absl::string_view key, absl::string_view value);
// Returns the checksum at the end of `value`, which is its last eight bytes; 0 if the value is shorter.
uint64_t stored_checksum(absl::string_view value);

// Adds a chunk to `list`; `value` is its stored form.
void add_chunk(ChunkList& list, absl::string_view value);

std::string encode(const SceneRow& row);
std::string encode(const CatalogueRow& row);
std::string encode(const ContentRow& row);
std::string encode(const MeshRow& row);
std::optional<SceneRow> decode_scene(absl::string_view bytes);
std::optional<CatalogueRow> decode_catalogue(absl::string_view bytes);
std::optional<ContentRow> decode_content(absl::string_view bytes);
std::optional<MeshRow> decode_mesh(absl::string_view bytes);

// The value of a record is its head, its bytes and a checksum. The three parts are built separately, so that the bytes
// are copied only once, into the write batch.
inline constexpr size_t kRecordHeadBytes = 1 + 8 + 8 + 8 + 4;
inline constexpr size_t kRecordOverhead = kRecordHeadBytes + 8;
// Decodes the value of a record. The result borrows from `value`; no value if `value` is malformed. Does not verify the
// checksum.
std::optional<LogEntry> decode_record(absl::string_view value);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_ROWS_H_
