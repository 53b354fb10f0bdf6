// Repairs a damaged data directory for `locusd repair`: copies every intact part into a new database and moves the old
// database, unchanged, into the folder before-repair-N. Free functions; any thread.
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
  bool dropped = false;    // no part of the scene was kept
  bool deleted = false;    // a deleted scene had reappeared and was deleted again; nothing is lost
  uint64_t kept_to = 0;    // sequence number of the last record that was kept
  uint64_t lost_from = 0;  // sequence number of the first lost record; 0 if no lost record is known
  uint64_t lost_to = 0;
  uint64_t epoch = 0;  // epoch after the repair; a new epoch, because readers may have seen lost records
};

struct MeshRepair {
  std::string name;
  std::string damage;
  bool dropped = false;
  bool parts_dropped = false;  // the mesh is kept, but without the names of its parts
};

struct RepairReport {
  DirectoryReport found;            // state found before the repair
  bool changed = false;             // whether the database described by `found` was replaced by a repaired one
  std::vector<SceneRepair> scenes;  // damaged scenes only
  std::vector<MeshRepair> meshes;   // damaged meshes only
  std::string kept_at;              // folder to which the old database was moved
  // If an earlier repair was interrupted, this call finished it first. In that case `finished_at` is the folder of that
  // repair's old database, and the losses of that repair are not in this report. Otherwise empty.
  std::string finished_at;
};

// Repairs the directory. Needs disk space for a copy of the intact part. After an error or a crash, either the
// directory is unchanged, or the next call of repair() finishes this repair. Errors: NOT_FOUND if the directory does
// not exist; FAILED_PRECONDITION if a process has it open or this version of locusd does not know its format; DATA_LOSS
// if no part is readable; RESOURCE_EXHAUSTED if the disk is full; UNAVAILABLE for any other error of the disk. Shows
// its phases through `progress`, if that is not null.
absl::StatusOr<RepairReport> repair(const StorageOptions& options, ProgressWriter* progress = nullptr);

// Returns the report as text for people, with one line for each damaged scene and mesh.
std::string to_text(const RepairReport& report);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_REPAIR_H_
