// Watches what RocksDB reads from its write-ahead log while it opens: each batch carries the number of its first write,
// so that a batch that went missing leaves a gap, however RocksDB came over it. It knows of what skipped over a place
// it could not read, and which scenes have records after it, so that only those others are in doubt.
//
// Threads: RocksDB calls it from the thread that opens; read it after that.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_WAL_WATCH_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_WAL_WATCH_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/container/flat_hash_set.h"
#include "core/scene/log/update_log.h"
#include "rocksdb/wal_filter.h"

namespace locus::server {

// What becomes of a gap.
enum class AtGap : uint8_t {
  kRefuse,  // the database does not open
  kGoOn,
};

class WalWatch final : public rocksdb::WalFilter {
 public:
  explicit WalWatch(AtGap at_gap) : at_gap_(at_gap) {}

  // The number of the last write before the end of the last gap; 0 where there was none.
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
  uint64_t next_ = 0;  // number of the next write, 0 before the first
  uint64_t gap_end_ = 0;
  absl::flat_hash_set<SceneKey> after_gap_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_WAL_WATCH_H_
