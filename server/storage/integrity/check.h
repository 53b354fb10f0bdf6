// What is wrong with a data directory, if anything: for `locusd check`, and for whoever repairs one. Reads every byte
// and changes none. Free functions; any thread.
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
  uint64_t last_sequence = 0;      // records are there without a gap up to here ...
  uint64_t expected_sequence = 0;  // ... and must be up to here at least
  uint64_t snapshot_chunks = 0;
  uint64_t snapshot_bytes = 0;
  uint64_t log_bytes = 0;
  std::string damage;  // empty where it is sound
};

struct MeshReport {
  std::string name;
  Sha256 sha256 = {};
  uint64_t bytes = 0;
  std::string damage;
};

struct DirectoryReport {
  std::string damage;            // nothing can be read, and why
  std::string catalogue_damage;  // names may be missing below, or were deleted
  bool closed_in_order = false;
  std::vector<SceneReport> scenes;  // by name
  std::vector<MeshReport> meshes;   // by name

  bool intact() const;
};

// NOT_FOUND where there is no data directory, FAILED_PRECONDITION where a process has it open or another version wrote
// it, UNAVAILABLE for a disk that fails. Damage is no error.
absl::StatusOr<DirectoryReport> check(const StorageOptions& options);

DirectoryReport report_of(const DamageReport& damage_report);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_CHECK_H_
