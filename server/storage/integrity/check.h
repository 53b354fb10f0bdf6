// Verifies a data directory for `locusd check`; repair() uses the same report. Reads every byte of the database, unless
// the database cannot be opened, and changes no file. Free functions; any thread.
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
  uint64_t last_sequence = 0;      // sequence number of the last record before the first missing record
  uint64_t expected_sequence = 0;  // sequence number of the last record that must exist
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
  std::string damage;  // reason why no part of the directory is readable; empty if a part is readable
  // Reason why `scenes` and `meshes` may be incomplete or contain deleted scenes and meshes; empty if they are correct.
  std::string catalogue_damage;
  bool closed_in_order = false;
  std::vector<SceneReport> scenes;  // sorted by name
  std::vector<MeshReport> meshes;   // sorted by name

  bool intact() const;
};

// Verifies every byte of the data directory. Damage is part of the report, not an error. Errors: NOT_FOUND if there is
// no data directory, FAILED_PRECONDITION if a process has the directory open or this version of locusd does not know
// its format, UNAVAILABLE if the disk fails. Shows its phases through `progress`, if that is not null.
absl::StatusOr<DirectoryReport> check(const StorageOptions& options, ProgressWriter* progress = nullptr);

// Converts the result of verify() to the report that `locusd check` prints.
DirectoryReport report_of(const DamageReport& damage_report);

// Returns the report as text for people, with one line for each scene and mesh.
std::string to_text(const DirectoryReport& report);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_CHECK_H_
