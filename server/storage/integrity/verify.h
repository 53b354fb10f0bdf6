// Judges what a data directory holds: every scene by its own numbers and checksums and by what HIGH_WATER says must be
// there. What RocksDB believes of itself counts for nothing here, only what it hands out. Free functions; any thread.
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
  std::optional<SceneRow> row;  // nothing where it is lost
  uint64_t row_checksum = 0;
  uint64_t last = 0;  // of the records that are there without a gap ...
  uint64_t running_checksum = 0;
  uint64_t log_bytes = 0;
  uint64_t expected_sequence = 0;  // ... and how far they must go at least
  bool copied = false;             // as of Mark
  std::string damage;              // what is wrong, empty where nothing is
};

struct MeshHealth {
  std::string name;
  Sha256 sha256 = {};
  ContentRow content;
  std::optional<ContentRow> parts;  // none where they stand with the content
  std::string damage;
};

struct DamageReport {
  bool has_format = false;
  uint32_t format = kFormat;
  Catalogue::Rows rows;  // all that are sound by themselves
  std::optional<CatalogueRow> catalogue;
  std::vector<SceneHealth> scenes;   // those that are there and those that must be, by key
  std::vector<MeshHealth> meshes;    // by name
  std::string catalogue_damage;      // names may be missing, or be back; then no mesh is believed
  std::vector<std::string> pending;  // keys of chunks whose snapshot or mesh was not finished
};

// Whether a chunk or record is read, or only its key.
enum class Depth : uint8_t { kKeys, kEverything };

// UNAVAILABLE where the disk fails, and FAILED_PRECONDITION for a format of another version. `high_water` is null where
// it was lost; then everything is damaged.
absl::StatusOr<DamageReport> verify(const Database& database, const DurableMarker* durable_marker, Depth depth);

// What to do about damage, as the end of a message.
std::string repair_hint(const std::string& path);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_VERIFY_H_
