// Looks whether a data directory is sound, without changing a byte of it: for `locusd check`. Every record and every
// chunk is read. Plain data and a free function; any thread.
#ifndef LOCUS_SERVER_STORAGE_CHECK_H_
#define LOCUS_SERVER_STORAGE_CHECK_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/storage/storage_options.h"

namespace locus::server {

struct CheckedScene {
  std::string name;
  uint64_t snapshot_sequence = 0;  // the snapshot holds all records up to here
  uint64_t last_sequence = 0;      // of the last record
  uint64_t log_bytes = 0;
  std::string damage;  // empty where it is sound
};

struct CheckedMesh {
  std::string name;
  std::string damage;
};

struct DirectoryReport {
  std::string damage;  // of the directory as a whole: scenes may be missing below
  std::vector<CheckedScene> scenes;
  std::vector<CheckedMesh> meshes;

  bool sound() const;
};

// FAILED_PRECONDITION where a process has it open, NOT_FOUND where there is none, UNAVAILABLE for what the disk says.
absl::StatusOr<DirectoryReport> check_directory(const StorageOptions& options);

// For people, a line each.
std::string to_text(const DirectoryReport& report);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_CHECK_H_
