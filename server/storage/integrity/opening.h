// From a path to a database whose contents are judged: makes a new data directory, opens a sound one, and gets out of a
// damaged one what can be read. What damage was found is in HIGH_WATER before anything on the disk is changed, so that
// opening a directory never makes damage unseen. Free functions; any thread.
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

// Held by whoever has the data directory open; released with it.
class DirectoryLock {
 public:
  static constexpr absl::string_view kName = "IN_USE";

  // FAILED_PRECONDITION where another process, or this one, has it.
  static absl::StatusOr<std::unique_ptr<DirectoryLock>> take(rocksdb::Env& env, const std::string& path);
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
  DurableMarker durable_marker;  // as it was found, with what damage was found since
  DamageReport damage_report;
};

// The options with nothing left open: env, and reserve and buffer as this disk allows.
StorageOptions with_defaults(StorageOptions options);
DatabaseOptions database_options_of(const StorageOptions& options);

// `options` are settled. Errors as of RocksdbLog::open().
absl::StatusOr<OpenedDirectory> open_directory(const StorageOptions& options);

// How the database's list of its files compares with HIGH_WATER: DATA_LOSS where it is not there, or shorter.
absl::Status check_file_list(rocksdb::Env& env, const std::string& database_folder,
                             const DurableMarker& durable_marker);
// The list's name and length now, of what is on the disk.
void describe_file_list(const Database& database, DurableMarker& durable_marker);

// A repair that did not come to its end leaves this folder in the data directory.
inline constexpr absl::string_view kRepairedFolder = "repaired";

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_INTEGRITY_OPENING_H_
