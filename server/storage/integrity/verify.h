// Verifies every scene and mesh of a data directory by its sequence numbers, its checksums and the durable marker. Does
// not rely on RocksDB to detect damage. Free functions; any thread.
#ifndef LOCUS_SERVER_STORAGE_INTEGRITY_VERIFY_H_
#define LOCUS_SERVER_STORAGE_INTEGRITY_VERIFY_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/progress_writer.h"
#include "core/scene/log/update_log.h"
#include "server/storage/integrity/durable_marker.h"
#include "server/storage/rocksdb/catalogue.h"
#include "server/storage/rocksdb/database.h"
#include "server/storage/rocksdb/rows.h"

namespace locus::server {

struct SceneHealth {
  SceneKey key = 0;
  std::string name;
  std::optional<SceneRow> row;  // no value if the scene's row is lost
  uint64_t row_checksum = 0;
  uint64_t last = 0;              // sequence number of the last record before the first missing record
  uint64_t running_checksum = 0;  // checksum of record `last`
  uint64_t log_bytes = 0;
  uint64_t expected_sequence = 0;  // sequence number of the last record that must exist
  // True if back_up() made this directory as a copy, and the scene still has the epoch of the original scene.
  bool copied = false;
  std::string damage;  // description of the damage; empty if the scene is intact
};

struct MeshHealth {
  std::string name;
  Sha256 sha256 = {};
  ContentRow content;
  std::optional<ContentRow> parts;  // no value in format 1, where the content's chunks include the parts
  uint32_t grace_s = 0;             // see MeshRow
  std::string damage;
};

struct DamageReport {
  bool has_format = false;
  uint32_t format = kFormat;
  Catalogue::Rows rows;  // every row with a correct checksum
  std::optional<CatalogueRow> catalogue;
  std::vector<SceneHealth> scenes;  // scenes of the catalogue and of the durable marker, sorted by key
  std::vector<MeshHealth> meshes;   // sorted by name
  // If not empty, the reason why the catalogue may lack rows, or may contain rows that were deleted. All meshes then
  // count as damaged.
  std::string catalogue_damage;
  std::vector<std::string> pending;  // keys of unfinished snapshots and meshes
};

// Depth of the verification: kKeys reads keys and stored checksums; kEverything also reads every byte of chunks and
// records.
enum class Depth : uint8_t { kKeys, kEverything };

// Verifies the database against the durable marker. `durable_marker` is null if the marker is lost; then all scenes and
// meshes count as damaged. Errors: UNAVAILABLE if the disk fails, FAILED_PRECONDITION if this version of locusd does
// not know the directory's format.
// With `progress`, counts in its current phase the bytes that were read.
absl::StatusOr<DamageReport> verify(const Database& database, const DurableMarker* durable_marker, Depth depth,
                                    ProgressWriter* progress = nullptr);

// Returns advice on how to repair the data directory `path`, to be appended to an error message about damage.
std::string repair_hint(const std::string& path);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_VERIFY_H_
