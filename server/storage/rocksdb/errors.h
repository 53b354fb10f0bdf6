// What RocksDB and the file system say, as the statuses that UpdateLog promises, and small things every file here asks
// of the file system. Free functions; any thread.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_ERRORS_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_ERRORS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "rocksdb/env.h"
#include "rocksdb/status.h"

namespace locus::server {

// RESOURCE_EXHAUSTED for a full disk, DATA_LOSS for what does not hold together, UNAVAILABLE for any other failure of
// the disk. `doing` says what was tried.
absl::Status disk_error(absl::string_view doing, const rocksdb::Status& status);

// The same for what RocksDB reads from its own files: one that is missing is damage, too.
absl::Status read_error(absl::string_view doing, const rocksdb::Status& status);

// RESOURCE_EXHAUSTED: `free_bytes` are left of the disk, of which `reserve_bytes` are not for this.
absl::Status refuse_full_disk(absl::string_view what, uint64_t reserve_bytes, uint64_t free_bytes);

// Whether RocksDB said of its files, and not of the disk beneath, that they are not as they were written.
bool says_damage(const rocksdb::Status& status);

// New and renamed files of `folder` are there after a power loss, too.
rocksdb::Status sync_folder(rocksdb::Env& env, const std::string& folder);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_ERRORS_H_
