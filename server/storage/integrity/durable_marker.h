// HIGH_WATER, the small file beside the database that says what must be in it: the scenes, how far each one's log was
// synced, and how often the catalogue was changed. What the database lost without noticing, a cut tail of its own log
// for one, is noticed by this. It never says more than what is on the disk.
//
// The file is two slots of one size; writes alternate between them, in place, each with a number that grows and a
// checksum, so that a torn write leaves the one before. A file whose slots became too small is replaced as a whole.
//
// Threads: one at a time.
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

// A scene as it must be found.
struct SceneMarker {
  SceneKey scene = 0;
  std::string name;
  uint64_t sequence = 0;          // at least up to here there are records
  uint64_t running_checksum = 0;  // the checksum of that record, or of the snapshot's last
  uint64_t row_checksum = 0;      // of its row in the catalogue, exactly
  bool copied = false;            // by back_up(), and not restarted since
  std::string damage;             // found earlier; stays until the scene is deleted or repaired
};

struct DurableMarker {
  uint64_t number = 0;            // of this write
  bool closed = false;            // nothing came after this
  uint64_t catalogue = 0;         // generation; 0 before the database was made
  SceneKey next_scene = 1;        // keys below were given to scenes
  uint64_t mesh_sum = 0;          // of the catalogue's rows of meshes
  uint64_t flushed_sequence = 0;  // of RocksDB: all writes up to here are in what this says
  std::string manifest;           // RocksDB's list of its files ...
  uint64_t manifest_bytes = 0;    // ... and how long it was at least
  std::string catalogue_damage;   // found earlier, of the catalogue as a whole
  std::vector<SceneMarker> scene_markers;
};

std::string encode(const DurableMarker& durable_marker);
std::optional<DurableMarker> decode_durable_marker(absl::string_view bytes);

class DurableMarkerFile {
 public:
  static constexpr absl::string_view kName = "HIGH_WATER";

  // What the file in `folder` says: NOT_FOUND where there is none, DATA_LOSS where neither slot can be read.
  static absl::StatusOr<DurableMarker> read(rocksdb::Env& env, const std::string& folder);

  DurableMarkerFile(rocksdb::Env& env, std::string folder) : env_(env), folder_(std::move(folder)) {}

  // On the disk when this returns. Numbers the write; the first makes the file or replaces it whole.
  absl::Status write(DurableMarker& durable_marker);
  // The same for both slots: what is written must not be undone by damage to one of them.
  absl::Status replace(DurableMarker& durable_marker);

 private:
  rocksdb::Env& env_;
  const std::string folder_;
  std::unique_ptr<rocksdb::RandomRWFile> file_;
  size_t slot_bytes_ = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_DURABLE_MARKER_H_
