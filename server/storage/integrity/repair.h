// Makes a damaged data directory one that opens: for `locusd repair`. What is sound is copied into a new database; what
// was there stays as it was, in a folder beside. Free functions; any thread.
#ifndef LOCUS_SERVER_STORAGE_INTEGRITY_REPAIR_H_
#define LOCUS_SERVER_STORAGE_INTEGRITY_REPAIR_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/storage/integrity/check.h"
#include "server/storage/rocksdb/storage_options.h"

namespace locus::server {

// What became of a scene that was damaged.
struct SceneRepair {
  SceneKey key = 0;
  std::string name;
  std::string damage;
  bool dropped = false;    // nothing of it could be kept
  bool deleted = false;    // it had been deleted before, and is again: nothing is lost
  uint64_t kept_to = 0;    // records up to here are there
  uint64_t lost_from = 0;  // 0 = none that is known of
  uint64_t lost_to = 0;
  uint64_t epoch = 0;  // from now on; another than before, since readers may have seen what is lost
};

struct MeshRepair {
  std::string name;
  std::string damage;
  bool dropped = false;
};

struct RepairReport {
  DirectoryReport found;            // before
  bool changed = false;             // false: everything was sound, and nothing was touched
  std::vector<SceneRepair> scenes;  // that were damaged
  std::vector<MeshRepair> meshes;   // likewise
  std::string kept_at;              // the folder with what was there before
};

// Nobody may have the directory open. It needs room for a copy of what is sound. After an error, or if the process
// ends, everything is as it was, or the next repair goes on. Errors as of check(), and RESOURCE_EXHAUSTED.
absl::StatusOr<RepairReport> repair(const StorageOptions& options);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_REPAIR_H_
