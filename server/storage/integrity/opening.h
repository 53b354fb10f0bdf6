// Opens a data directory: creates a missing directory, verifies an intact one, and keeps the readable part of a damaged
// one. Damage is recorded in the durable marker before any other file changes, so that every later opening reports the
// damage again. The diagram in server/storage/README.md shows the order of the steps. Free functions; any thread.
#ifndef LOCUS_SERVER_STORAGE_INTEGRITY_OPENING_H_
#define LOCUS_SERVER_STORAGE_INTEGRITY_OPENING_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "rocksdb/env.h"
#include "server/storage/integrity/durable_marker.h"
#include "server/storage/integrity/verify.h"
#include "server/storage/rocksdb/database.h"
#include "server/storage/rocksdb/storage_options.h"

namespace locus::server {

// Exclusive lock of a data directory, the file IN_USE; released by the destructor.
class DirectoryLock {
 public:
  static constexpr absl::string_view kName = "IN_USE";

  // Acquires the lock. FAILED_PRECONDITION if any process, including this one, already holds the lock.
  static absl::StatusOr<std::unique_ptr<DirectoryLock>> acquire(rocksdb::Env& env, const std::string& path);
  ~DirectoryLock();
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

 private:
  DirectoryLock(rocksdb::Env& env, rocksdb::FileLock* lock) : env_(env), lock_(lock) {}

  rocksdb::Env& env_;
  rocksdb::FileLock* const lock_;
};

struct OpenedDirectory {
  std::unique_ptr<DirectoryLock> lock;
  std::unique_ptr<Database> database;
  std::unique_ptr<DurableMarkerFile> durable_marker_file;
  DurableMarker durable_marker;  // marker as read from the disk, plus the damage found by this opening
  DamageReport damage_report;
};

// Returns `options` with a default file system if `env` is null, and a default disk reserve if `reserve_bytes` has no
// value. Limits the log buffer to a share of the disk's size, but not below a minimum.
StorageOptions with_defaults(StorageOptions options);
DatabaseOptions database_options_of(const StorageOptions& options);

// Opens and verifies the directory. Precondition: `options` are a result of with_defaults(). Errors:
// FAILED_PRECONDITION if a process has the directory open, if its format is unknown or if a repair was interrupted;
// DATA_LOSS if the directory is too damaged to be opened; UNAVAILABLE or RESOURCE_EXHAUSTED for an error of the disk.
absl::StatusOr<OpenedDirectory> open_directory(const StorageOptions& options);

// Compares RocksDB's list of its files, the MANIFEST, with the durable marker. DATA_LOSS if the database is missing.
// RocksDB starts a new MANIFEST at times. If the current MANIFEST has another name than the one in the marker, returns
// OK without a further check. Otherwise returns DATA_LOSS if the MANIFEST is missing, or shorter than the length in the
// marker.
absl::Status check_file_list(rocksdb::Env& env, const std::string& database_folder,
                             const DurableMarker& durable_marker);
// Stores the current name and length of the MANIFEST in the durable marker.
void describe_file_list(const Database& database, DurableMarker& durable_marker);

// Folder in the data directory that exists only during a repair. An interrupted repair leaves this folder behind, and
// open_directory() then fails until the repair is run again.
inline constexpr absl::string_view kRepairedFolder = "repaired";

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_OPENING_H_
