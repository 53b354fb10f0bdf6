#include "server/storage/rocksdb/wal_watch.h"

#include "server/storage/rocksdb/database.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {
namespace {

// Collects the scenes that have log records in a batch; ignores all other writes.
class SceneCollector final : public rocksdb::WriteBatch::Handler {
 public:
  SceneCollector(uint32_t log_family, absl::flat_hash_set<SceneKey>& scenes)
      : log_family_(log_family), scenes_(scenes) {}

  rocksdb::Status PutCF(uint32_t family, const rocksdb::Slice& key, const rocksdb::Slice&) override {
    if (family == log_family_ && key.size() == 16) scenes_.insert(RowReader({key.data(), key.size()}).big_u64());
    return rocksdb::Status::OK();
  }
  rocksdb::Status DeleteCF(uint32_t, const rocksdb::Slice&) override { return rocksdb::Status::OK(); }
  rocksdb::Status DeleteRangeCF(uint32_t, const rocksdb::Slice&, const rocksdb::Slice&) override {
    return rocksdb::Status::OK();
  }

 private:
  const uint32_t log_family_;
  absl::flat_hash_set<SceneKey>& scenes_;
};

}  // namespace

void WalWatch::ColumnFamilyLogNumberMap(const std::map<uint32_t, uint64_t>&,
                                        const std::map<std::string, uint32_t>& ids) {
  const auto found = ids.find(std::string(kLogFamily));
  if (found != ids.end()) log_family_ = found->second;
}

rocksdb::WalFilter::WalProcessingOption WalWatch::LogRecordFound(unsigned long long, const std::string&,
                                                                 const rocksdb::WriteBatch& batch, rocksdb::WriteBatch*,
                                                                 bool*) {
  // A batch begins with the RocksDB sequence number of its first write. WriteBatch has no accessor for this number.
  const std::string& bytes = batch.Data();
  const uint64_t first = RowReader(bytes).u64();
  const bool gap = next_write_ != 0 && first > next_write_;
  if (gap && at_gap_ == AtGap::kRefuse) return WalProcessingOption::kCorruptedRecord;
  if (gap) {
    gap_end_ = first - 1;
    after_gap_.clear();
  }
  next_write_ = first + batch.Count();
  if (gap_end_ != 0) {
    SceneCollector collector(log_family_, after_gap_);
    batch.Iterate(&collector).PermitUncheckedError();  // after an error the scenes collected so far are still correct
  }
  return WalProcessingOption::kContinueProcessing;
}

}  // namespace locus::server
