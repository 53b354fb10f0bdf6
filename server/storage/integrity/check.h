// Verifies a data directory for `locusd check` and for repair(). Reads every byte and changes none. Free functions; any
// thread.
#ifndef LOCUS_SERVER_STORAGE_INTEGRITY_CHECK_H_
#define LOCUS_SERVER_STORAGE_INTEGRITY_CHECK_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/scene/log/update_log.h"
#include "server/storage/integrity/verify.h"
#include "server/storage/rocksdb/storage_options.h"

namespace locus::server {

struct SceneReport {
  SceneKey key = 0;
  std::string name;
  uint64_t epoch = 0;
  uint64_t snapshot_sequence = 0;
  uint64_t last_sequence = 0;      // last record before the first missing one
  uint64_t expected_sequence = 0;  // last record that must exist
  uint64_t snapshot_chunks = 0;
  uint64_t snapshot_bytes = 0;
  uint64_t log_bytes = 0;
  std::string damage;  // description of the damage; empty if the scene is intact
};

struct MeshReport {
  std::string name;
  Sha256 sha256 = {};
  uint64_t bytes = 0;
  std::string damage;
};

struct DirectoryReport {
  std::string damage;            // reason why nothing is readable
  std::string catalogue_damage;  // reason why scenes or meshes may be missing below, or deleted ones present
  bool closed_in_order = false;
  std::vector<SceneReport> scenes;  // sorted by name
  std::vector<MeshReport> meshes;   // sorted by name

  bool intact() const;
};

// Verifies every byte. Damage is part of the report, not an error. Errors: NOT_FOUND if there is no data directory,
// FAILED_PRECONDITION if a process has it open or another version wrote it, UNAVAILABLE if the disk fails.
absl::StatusOr<DirectoryReport> check(const StorageOptions& options);

// Converts the result of verify() to the report that is shown to people.
DirectoryReport report_of(const DamageReport& damage_report);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_CHECK_H_
