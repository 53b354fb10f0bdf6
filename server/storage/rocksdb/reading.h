// Reads records and chunks out of a database, and judges each as it comes by: what is handed on is what was written.
// Free functions; any thread.
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

// How everything here is read. What was deleted as a range is seen again: RocksDB 7.8 crashes where it meets both such
// a range and a table that cannot be read. It costs nothing, since no key is used for two things.
rocksdb::ReadOptions reading_options();

// What one look over a scene's records finds without judging their bytes.
struct RecordScan {
  uint64_t last = 0;              // up to here none is missing
  uint64_t running_checksum = 0;  // the checksum of that one
  uint64_t bytes = 0;
  uint64_t beyond = 0;  // the first that comes after a missing one, or 0
  uint64_t after = 0;   // how many there are from there on
  absl::Status error;   // what ended the look, if not the scene's end
};

// Of the records after `row`'s snapshot. `sequence` is one whose checksum is wanted beside, in `chain_at` (unchanged
// where it is not there).
RecordScan scan_records(const Database& database, const SceneRow& row, uint64_t sequence, uint64_t& chain_at);

// The records from number `from` on, which must go up to `last` at least, until `sink` fails; `chain` is the checksum
// of the one before.
absl::Status read_records(const Database& database, SceneKey scene, uint64_t from, uint64_t last,
                          uint64_t running_checksum, RecordSink sink);

// The chunks whose keys begin with `prefix`, which must be those that `list` was made of.
absl::Status read_chunks(const Database& database, rocksdb::ColumnFamilyHandle* family, const std::string& prefix,
                         const ChunkList& list, ChunkSink sink);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_READING_H_
