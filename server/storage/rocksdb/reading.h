// Reads records and chunks from a database, and verifies the checksum of each before passing it to the sink. Free
// functions; any thread.
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

// Returns the options that every read must use. They ignore range deletions, because RocksDB 7.8 crashes if an iterator
// meets both a range deletion and an unreadable table. So deleted keys stay visible, which is safe because no key is
// ever reused.
rocksdb::ReadOptions reading_options();

// Result of a scan over a scene's records that reads their stored checksums but does not verify them.
struct RecordScan {
  uint64_t last = 0;              // last sequence number before the first missing one
  uint64_t running_checksum = 0;  // stored checksum of record `last`
  uint64_t bytes = 0;             // payload of the records up to `last`
  uint64_t first_after_gap = 0;   // first record after a missing one; 0 if none is missing
  uint64_t count_after_gap = 0;   // records from first_after_gap on
  absl::Status error;             // error that ended the scan early
};

// Scans the records after the snapshot of `row`. Stores the checksum of record `sequence` in `checksum_at`, which stays
// unchanged if that record is missing.
RecordScan scan_records(const Database& database, const SceneRow& row, uint64_t sequence, uint64_t& checksum_at);

// Passes the records with sequence numbers from `from` on to `sink`, until the sink returns an error.
// `running_checksum` is the checksum of the record before `from`. DATA_LOSS at the first record that is missing or
// damaged, and if the records end before `last`.
absl::Status read_records(const Database& database, SceneKey scene, uint64_t from, uint64_t last,
                          uint64_t running_checksum, RecordSink sink);

// Passes the chunks whose keys begin with `prefix` to `sink`, in order, until the sink returns an error. DATA_LOSS if a
// chunk is damaged, or if the chunks together do not match the summary `list`.
absl::Status read_chunks(const Database& database, rocksdb::ColumnFamilyHandle* family, const std::string& prefix,
                         const ChunkList& list, ChunkSink sink);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_READING_H_
