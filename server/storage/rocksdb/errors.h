// Converts RocksDB's statuses to the errors that UpdateLog documents, and syncs folders. Free functions; any thread.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_ERRORS_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_ERRORS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "rocksdb/env.h"
#include "rocksdb/status.h"

namespace locus::server {

// Converts an error of a write or of the file system: RESOURCE_EXHAUSTED for a full disk, DATA_LOSS for damage,
// UNAVAILABLE for any other failure. `doing` names the operation in the message.
absl::Status disk_error(absl::string_view doing, const rocksdb::Status& status);

// Converts an error of reading RocksDB's own files: DATA_LOSS for a missing file, otherwise the result of disk_error().
absl::Status read_error(absl::string_view doing, const rocksdb::Status& status);

// Returns the RESOURCE_EXHAUSTED error of a write of `bytes` bytes that would leave less than `reserve_bytes` free on
// the disk; the reserve is for snapshots and recovery. `free_bytes` is the disk's free space before the write. `what`
// names the operation in the message.
absl::Status refuse_full_disk(absl::string_view what, uint64_t bytes, uint64_t reserve_bytes, uint64_t free_bytes);

// Returns the RESOURCE_EXHAUSTED error of writes that cannot resume after a disk error: resuming needs `needed_bytes`
// of free space on the disk, which has only `free_bytes`.
absl::Status refuse_recovery(uint64_t needed_bytes, uint64_t free_bytes);

// Returns whether `status` reports damaged or missing files, as opposed to a failing, full or busy disk.
bool is_damage(const rocksdb::Status& status);

// Syncs `folder`, so that new and renamed files in it survive a power loss.
rocksdb::Status sync_folder(rocksdb::Env& env, const std::string& folder);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_ERRORS_H_
