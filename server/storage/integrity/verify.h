// Verifies the contents of a data directory: every scene and mesh by sequence numbers, checksums and the durable
// marker. Does not rely on RocksDB to detect damage. Free functions; any thread.
#ifndef LOCUS_SERVER_STORAGE_INTEGRITY_VERIFY_H_
#define LOCUS_SERVER_STORAGE_INTEGRITY_VERIFY_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/scene/log/update_log.h"
#include "server/storage/integrity/durable_marker.h"
#include "server/storage/rocksdb/catalogue.h"
#include "server/storage/rocksdb/database.h"
#include "server/storage/rocksdb/rows.h"

namespace locus::server {

struct SceneHealth {
  SceneKey key = 0;
  std::string name;
  std::optional<SceneRow> row;  // nothing if the scene's row is lost
  uint64_t row_checksum = 0;
  uint64_t last = 0;              // last record before the first missing one
  uint64_t running_checksum = 0;  // checksum of record `last`
  uint64_t log_bytes = 0;
  uint64_t expected_sequence = 0;  // last record that must exist
  bool copied = false;             // SceneMarker::copied
  std::string damage;              // description of the damage; empty if the scene is intact
};

struct MeshHealth {
  std::string name;
  Sha256 sha256 = {};
  ContentRow content;
  std::optional<ContentRow> parts;  // nothing in format 1, which stores the parts with the content
  std::string damage;
};

struct DamageReport {
  bool has_format = false;
  uint32_t format = kFormat;
  Catalogue::Rows rows;  // every row with a correct checksum
  std::optional<CatalogueRow> catalogue;
  std::vector<SceneHealth> scenes;   // scenes of the catalogue and of the durable marker, sorted by key
  std::vector<MeshHealth> meshes;    // sorted by name
  std::string catalogue_damage;      // set if names may be missing or deleted ones present; then all meshes are damaged
  std::vector<std::string> pending;  // keys of unfinished snapshots and meshes
};

// Depth of the verification: kKeys reads keys and stored checksums; kEverything also reads every byte of chunks and
// records.
enum class Depth : uint8_t { kKeys, kEverything };

// Verifies the database against the durable marker. `durable_marker` is null if the marker is lost; then everything
// counts as damaged. Errors: UNAVAILABLE if the disk fails, FAILED_PRECONDITION for a format of another version.
absl::StatusOr<DamageReport> verify(const Database& database, const DurableMarker* durable_marker, Depth depth);

// Returns advice on how to repair the data directory `path`, to be appended to an error message about damage.
std::string repair_hint(const std::string& path);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_VERIFY_H_
