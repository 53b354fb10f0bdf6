// The durable marker: a small file, HIGH_WATER, beside the database. The marker records which data the database must
// contain: the scenes, the last synced record of each scene, and the generation of the catalogue (the rows of scenes
// and meshes). So it reveals losses that RocksDB does not detect, such as a truncated log. Invariant: the marker never
// names data that is not synced.
//
// The file has two slots of equal size; ../rocksdb/FORMAT.md describes their bytes. Each write overwrites the slot with
// the older marker, so a torn write leaves the other slot valid. A slot contains a write number, which each write
// increments, and a checksum. If a slot is too small for the marker, the whole file is replaced.
//
// Threads: only one thread at a time may use a DurableMarkerFile.
#ifndef LOCUS_SERVER_STORAGE_INTEGRITY_DURABLE_MARKER_H_
#define LOCUS_SERVER_STORAGE_INTEGRITY_DURABLE_MARKER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/scene/log/update_log.h"
#include "rocksdb/env.h"

namespace locus::server {

// Minimum state of a scene that the database must contain.
struct SceneMarker {
  SceneKey scene = 0;
  std::string name;
  uint64_t sequence = 0;          // sequence number of the last synced record
  uint64_t running_checksum = 0;  // running checksum of record `sequence`
  uint64_t row_checksum = 0;      // checksum of the scene's row in the catalogue
  // True if back_up() made this directory as a copy, and the scene still has the epoch of the original scene.
  bool copied = false;
  // Damage found when the directory was opened; kept until the scene is deleted or repaired. Empty if intact.
  std::string damage;
};

struct DurableMarker {
  uint64_t write_number = 0;      // incremented by each write; the slot with the higher number is newer
  bool closed = false;            // true after a clean shutdown: no write followed this marker
  uint64_t catalogue = 0;         // generation of the catalogue; 0 until the database is created
  SceneKey next_scene = 1;        // next free scene key
  uint64_t mesh_sum = 0;          // sum of the checksums of the catalogue's mesh rows
  uint64_t flushed_sequence = 0;  // this marker covers every write up to this RocksDB sequence number
  std::string manifest;           // name of RocksDB's list of its files, the MANIFEST
  uint64_t manifest_bytes = 0;    // minimum length of the MANIFEST
  std::string catalogue_damage;   // damage of the catalogue found by an earlier opening
  std::vector<SceneMarker> scene_markers;
};

std::string encode(const DurableMarker& durable_marker);
std::optional<DurableMarker> decode_durable_marker(absl::string_view bytes);

class DurableMarkerFile {
 public:
  static constexpr absl::string_view kName = "HIGH_WATER";

  // Reads both slots of the file in `folder` and returns the marker of the valid slot with the higher write number.
  // NOT_FOUND if there is no file, DATA_LOSS if neither slot is valid, UNAVAILABLE for an error of the disk.
  static absl::StatusOr<DurableMarker> read(rocksdb::Env& env, const std::string& folder);

  DurableMarkerFile(rocksdb::Env& env, std::string folder) : env_(env), folder_(std::move(folder)) {}

  // Increments the write number, writes one slot and syncs the file. On the first call, after an error, and if the
  // marker does not fit into a slot, calls replace() instead.
  absl::Status write(DurableMarker& durable_marker);
  // Writes `durable_marker` into both slots of a new file, syncs the file and renames it to HIGH_WATER. So damage to
  // one slot cannot bring back an older marker.
  absl::Status replace(DurableMarker& durable_marker);

 private:
  rocksdb::Env& env_;
  const std::string folder_;
  std::unique_ptr<rocksdb::RandomRWFile> file_;
  size_t slot_bytes_ = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_DURABLE_MARKER_H_
