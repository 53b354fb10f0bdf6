// Detects gaps in RocksDB's write-ahead log (WAL) while the database opens. Each batch in the WAL carries the RocksDB
// sequence number of its first write, so a lost batch leaves a gap in these numbers even if RocksDB skipped it
// silently. Also collects the scenes that have records after the last gap. If the sequence numbers of such a scene's
// records have no gap, none of its records is missing. For a scene without records after the last gap, it is unknown
// whether records at its end are missing.
//
// Threads: RocksDB calls the filter from the thread that opens the database; read the results after the opening.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_WAL_WATCH_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_WAL_WATCH_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/container/flat_hash_set.h"
#include "core/scene/log/update_log.h"
#include "rocksdb/wal_filter.h"

namespace locus::server {

// Reaction to a gap in the log.
enum class AtGap : uint8_t {
  kRefuse,  // opening the database fails
  kContinue,
};

class WalWatch final : public rocksdb::WalFilter {
 public:
  explicit WalWatch(AtGap at_gap) : at_gap_(at_gap) {}

  // Returns the RocksDB sequence number of the last missing write; 0 if there was no gap.
  uint64_t gap_end() const { return gap_end_; }
  bool has_records_after_gap(SceneKey scene) const { return after_gap_.contains(scene); }

  const char* Name() const override { return "locus.wal_watch"; }
  void ColumnFamilyLogNumberMap(const std::map<uint32_t, uint64_t>& log_numbers,
                                const std::map<std::string, uint32_t>& ids) override;
  WalProcessingOption LogRecordFound(unsigned long long log_number, const std::string& log_name,
                                     const rocksdb::WriteBatch& batch, rocksdb::WriteBatch* new_batch,
                                     bool* batch_changed) override;

 private:
  const AtGap at_gap_;
  uint32_t log_family_ = 0;
  uint64_t next_write_ = 0;  // expected RocksDB sequence number of the next batch; 0 before the first batch
  uint64_t gap_end_ = 0;
  absl::flat_hash_set<SceneKey> after_gap_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_WAL_WATCH_H_
