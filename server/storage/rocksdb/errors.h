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

// Converts an error of reading RocksDB's own files as disk_error() does, but a missing file is DATA_LOSS.
absl::Status read_error(absl::string_view doing, const rocksdb::Status& status);

// Returns RESOURCE_EXHAUSTED for an operation that would leave less than `reserve_bytes` of the disk's `free_bytes`,
// which are reserved for snapshots. `what` names the refused operation in the message.
absl::Status refuse_full_disk(absl::string_view what, uint64_t reserve_bytes, uint64_t free_bytes);

// Returns whether `status` reports damaged or missing files, as opposed to a failing, full or busy disk.
bool is_damage(const rocksdb::Status& status);

// Syncs `folder`, so that new and renamed files in it survive a power loss.
rocksdb::Status sync_folder(rocksdb::Env& env, const std::string& folder);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_ERRORS_H_
