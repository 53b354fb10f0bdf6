// Repairs a damaged data directory for `locusd repair`: copies every intact part into a new database and moves the old
// one, unchanged, into the folder before-repair-N. Free functions; any thread.
#ifndef LOCUS_SERVER_STORAGE_INTEGRITY_REPAIR_H_
#define LOCUS_SERVER_STORAGE_INTEGRITY_REPAIR_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/storage/integrity/check.h"
#include "server/storage/rocksdb/storage_options.h"

namespace locus::server {

// Outcome of the repair for a damaged scene.
struct SceneRepair {
  SceneKey key = 0;
  std::string name;
  std::string damage;
  bool dropped = false;    // no part of the scene could be kept
  bool deleted = false;    // the scene had been deleted, reappeared, and is deleted again: nothing is lost
  uint64_t kept_to = 0;    // last record that was kept
  uint64_t lost_from = 0;  // first lost record; 0 = no lost record is known
  uint64_t lost_to = 0;
  uint64_t epoch = 0;  // epoch from now on; it differs from the old one because readers may have seen lost records
};

struct MeshRepair {
  std::string name;
  std::string damage;
  bool dropped = false;
};

struct RepairReport {
  DirectoryReport found;            // state found before the repair
  bool changed = false;             // false: everything was intact, no file was changed
  std::vector<SceneRepair> scenes;  // damaged scenes only
  std::vector<MeshRepair> meshes;   // damaged meshes only
  std::string kept_at;              // folder to which the old database was moved
};

// Repairs the directory, which no process may have open. Needs disk space for a copy of the intact part. After an error
// or a crash the directory is either unchanged, or the next repair finishes this one. Errors: those of check(), and
// RESOURCE_EXHAUSTED.
absl::StatusOr<RepairReport> repair(const StorageOptions& options);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_REPAIR_H_
