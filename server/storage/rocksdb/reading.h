// Reads records and chunks from a database. Verifies the checksum of each record or chunk before passing it to the
// sink. Free functions; any thread.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_READING_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_READING_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/scene/log/update_log.h"
#include "server/storage/rocksdb/database.h"
#include "server/storage/rocksdb/rows.h"

namespace locus::server {

inline absl::string_view view_of(const rocksdb::Slice& slice) { return {slice.data(), slice.size()}; }
inline rocksdb::Slice slice_of(absl::string_view view) { return {view.data(), view.size()}; }

// Returns the options that every read must use. The options ignore range deletions, because RocksDB 7.8 crashes if an
// iterator reads both a range deletion and an unreadable table. So keys in deleted ranges may still be found; that is
// safe, because no key in a deleted range is ever reused.
rocksdb::ReadOptions reading_options();

// Result of scan_records(), which reads the stored checksums of a scene's records but does not verify them.
struct RecordScan {
  uint64_t last = 0;              // sequence number of the last record before the first missing record
  uint64_t running_checksum = 0;  // stored checksum of record `last`
  uint64_t bytes = 0;             // total payload size of the scanned records up to `last`
  uint64_t first_after_gap = 0;   // sequence number of the first record after the missing ones; 0 if none is missing
  uint64_t count_after_gap = 0;   // number of records from first_after_gap on
  absl::Status error;             // error that ended the scan early
};

// Scans the records that follow the snapshot of the scene `row`. Stores the checksum of record `sequence` in
// `checksum_at`, which stays unchanged if that record is missing.
RecordScan scan_records(const Database& database, const SceneRow& row, uint64_t sequence, uint64_t& checksum_at);

// Passes record `from` and all later records of the scene to `sink`, in order, until the sink returns an error.
// `running_checksum` is the checksum of the record before `from`. Returns DATA_LOSS at the first record that is missing
// or damaged; every record up to `last` must exist.
absl::Status read_records(const Database& database, SceneKey scene, uint64_t from, uint64_t last,
                          uint64_t running_checksum, RecordSink sink);

// Passes the chunks whose keys begin with `prefix` to `sink`, in order, until the sink returns an error. `list` is the
// summary of these chunks. DATA_LOSS if a chunk is missing or damaged, or if the chunks do not match `list`.
absl::Status read_chunks(const Database& database, rocksdb::ColumnFamilyHandle* family, const std::string& prefix,
                         const ChunkList& list, ChunkSink sink);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_READING_H_
