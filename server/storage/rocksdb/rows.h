// Format 2 of what stands in RocksDB: the keys and values of its column families, each value with a checksum over key
// and value, so that one in a wrong place is noticed. Free functions on plain data; any thread.
//
// Format 1 is read, too: its rows of meshes have no parts, which stood among the content's chunks. A directory of
// format 1 becomes one of format 2 when it is opened.
//
// meta      "format"; "catalogue"; 's' scene: a scene; 'm' name: a mesh; 'c' sha256: a mesh's content; 'p' scene number
//           and 'q' sha256 number: chunks on their way into a snapshot or mesh
// log       scene sequence: a record. Each checksum takes in the one before, from the scene's first record on: none can
//           be left out, taken from another scene or come back from an earlier time without breaking this chain.
// snapshot  scene number index: a chunk
// mesh      sha256 number index: a chunk of the content, or of the parts of one name
// Numbers of snapshots and meshes are random and never used again: what was deleted is not looked at in reading, so
// that nothing may stand where something else was. In each family, under the key "\0", which sorts before all others,
// stands a mark that makes it show up in some table.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_ROWS_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_ROWS_H_

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include "core/scene/log/update_log.h"

namespace locus::server {

inline constexpr uint32_t kFormat = 2;
inline constexpr uint32_t kOldestFormat = 1;
inline constexpr absl::string_view kFormatKey = "format";
inline constexpr absl::string_view kCatalogueKey = "catalogue";
inline constexpr absl::string_view kFamilyMark("\0", 1);
inline constexpr char kSceneTag = 's';
inline constexpr char kMeshTag = 'm';
inline constexpr char kContentTag = 'c';
inline constexpr char kPendingSnapshotTag = 'p';
inline constexpr char kPendingMeshTag = 'q';

using Sha256 = std::array<uint8_t, 32>;

uint64_t checksum(absl::string_view bytes, uint64_t seed = 0);

// How many things of a chunked thing there are, and what they hash to in their order.
struct ChunkList {
  uint64_t chunks = 0;
  uint64_t bytes = 0;
  uint64_t digest = 0;

  void add(absl::string_view chunk_value);
  bool operator==(const ChunkList&) const = default;
};

// A mesh's content, or the parts of one name.
struct ContentRow {
  uint64_t number = 0;
  ChunkList chunks;
};

// A mesh's name.
struct MeshRow {
  Sha256 sha256 = {};
  std::optional<ContentRow> parts;  // none in format 1
};

struct SceneRow {
  SceneKey key = 0;
  std::string name;
  std::string spec;
  uint64_t epoch = 0;
  uint64_t snapshot_sequence = 0;
  uint64_t running_checksum = 0;  // of the record snapshot_sequence, with which the next one's checksum begins
  uint64_t snapshot_number = 0;
  ChunkList snapshot;
};

// What stands for the whole: the sums of the rows' checksums, and a number that grows by one with each change.
struct CatalogueRow {
  uint64_t generation = 0;
  SceneKey next_scene = 1;
  uint64_t scene_sum = 0;
  uint64_t mesh_sum = 0;
};

// Keys.
std::string scene_key(SceneKey scene);
std::string mesh_key(absl::string_view name);
std::string content_key(const Sha256& sha256);
std::string pending_snapshot_key(SceneKey scene, uint64_t number);
std::string pending_mesh_key(const Sha256& sha256, uint64_t number);
std::string log_key(SceneKey scene, uint64_t sequence);
// The first key that does not begin with `prefix`: the end of a range.
std::string end_of(std::string prefix);
std::string scene_prefix(SceneKey scene);
std::string snapshot_prefix(SceneKey scene, uint64_t number);
std::string mesh_prefix(const Sha256& sha256, uint64_t number);
// Of a chunk of the snapshot or mesh whose keys begin with `prefix`.
std::string chunk_key(absl::string_view prefix, uint32_t index);

// Values of the column family meta, and of chunks: bytes and their checksum.
std::string with_checksum(absl::string_view key, absl::string_view bytes);
// Nothing where the checksum says that these are not the bytes of `key`.
std::optional<absl::string_view> verified(absl::string_view key, absl::string_view value);
// The last eight bytes of any value.
uint64_t stored_checksum(absl::string_view value);

std::string encode(const SceneRow& row);
std::string encode(const CatalogueRow& row);
std::string encode(const ContentRow& row);
std::string encode(const MeshRow& row);
std::optional<SceneRow> decode_scene(absl::string_view bytes);
std::optional<CatalogueRow> decode_catalogue(absl::string_view bytes);
std::optional<ContentRow> decode_content(absl::string_view bytes);
std::optional<MeshRow> decode_mesh(absl::string_view bytes);

// A record's value is head, bytes, checksum; the three are made apart, so that the bytes are copied once.
inline constexpr size_t kRecordHeadBytes = 1 + 8 + 8 + 8 + 4;
inline constexpr size_t kRecordOverhead = kRecordHeadBytes + 8;
std::string record_head(const LogEntry& entry);
uint64_t record_checksum(absl::string_view key, absl::string_view head, absl::string_view bytes,
                         uint64_t running_checksum);
// Its entry borrows from `value`. Nothing where it is no record; its checksum is for the caller to compare.
std::optional<LogEntry> decode_record(absl::string_view value);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_ROWS_H_
