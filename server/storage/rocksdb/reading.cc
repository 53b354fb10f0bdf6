#include "server/storage/rocksdb/reading.h"

#include <memory>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "rocksdb/snapshot.h"
#include "server/storage/rocksdb/errors.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {
namespace {

constexpr size_t kReadAhead = size_t{2} << 20;

// Iterator over a range of keys of one family.
class Walk {
 public:
  Walk(const Database& database, rocksdb::ColumnFamilyHandle* family, const std::string& from, std::string end)
      : end_(std::move(end)), end_slice_(end_) {
    rocksdb::ReadOptions options = reading_options();
    options.readahead_size = kReadAhead;
    options.iterate_upper_bound = &end_slice_;
    iterator_.reset(database.db().NewIterator(options, family));
    iterator_->Seek(from);
  }

  bool more() const { return iterator_->Valid(); }
  void next() { iterator_->Next(); }
  absl::string_view key() const { return view_of(iterator_->key()); }
  absl::string_view value() const { return view_of(iterator_->value()); }
  rocksdb::Status status() const { return iterator_->status(); }

 private:
  const std::string end_;
  const rocksdb::Slice end_slice_;
  std::unique_ptr<rocksdb::Iterator> iterator_;
};

uint64_t sequence_of(absl::string_view log_key) { return RowReader(log_key.substr(8)).big_u64(); }

absl::Status damaged(absl::string_view what) { return absl::DataLossError(what); }

}  // namespace

rocksdb::ReadOptions reading_options() {
  rocksdb::ReadOptions options;
  options.fill_cache = false;
  options.ignore_range_deletions = true;
  return options;
}

RecordScan scan_records(const Database& database, const SceneRow& row, uint64_t sequence, uint64_t& checksum_at) {
  RecordScan found;
  found.last = row.snapshot_sequence;
  found.running_checksum = row.running_checksum;
  if (sequence == row.snapshot_sequence) checksum_at = row.running_checksum;
  Walk walk(database, database.log(), log_key(row.key, row.snapshot_sequence + 1), end_of(scene_prefix(row.key)));
  for (; walk.more(); walk.next()) {
    const uint64_t at = sequence_of(walk.key());
    if (found.first_after_gap == 0 && at != found.last + 1) found.first_after_gap = at;
    if (found.first_after_gap != 0) {
      ++found.count_after_gap;
      continue;
    }
    const absl::string_view value = walk.value();
    if (value.size() < kRecordOverhead) {
      found.error = damaged(absl::StrCat("record ", at, " is too short"));
      return found;
    }
    found.last = at;
    found.running_checksum = stored_checksum(value);
    found.bytes += value.size() - kRecordOverhead;
    if (at == sequence) checksum_at = found.running_checksum;
  }
  if (!walk.status().ok())
    found.error = read_error(absl::StrCat("reading the record after ", found.last), walk.status());
  return found;
}

absl::Status read_records(const Database& database, SceneKey scene, uint64_t from, uint64_t last,
                          uint64_t running_checksum, RecordSink sink) {
  Walk walk(database, database.log(), log_key(scene, from), end_of(scene_prefix(scene)));
  LogRecord record;
  for (record.sequence = from; walk.more(); walk.next(), ++record.sequence) {
    if (sequence_of(walk.key()) != record.sequence)
      return damaged(absl::StrCat("record ", record.sequence, " is missing"));
    const absl::string_view value = walk.value();
    const std::optional<LogEntry> entry = decode_record(value);
    if (!entry) return damaged(absl::StrCat("record ", record.sequence, " is malformed"));
    running_checksum = record_checksum(walk.key(), value.substr(0, kRecordHeadBytes), entry->bytes, running_checksum);
    if (running_checksum != stored_checksum(value))
      return damaged(absl::StrCat("record ", record.sequence, " does not match its checksum"));
    record.entry = *entry;
    RETURN_IF_ERROR(sink(record));
  }
  if (!walk.status().ok()) return read_error(absl::StrCat("reading record ", record.sequence), walk.status());
  if (record.sequence > last) return absl::OkStatus();
  return damaged(absl::StrCat("record ", record.sequence, " is missing"));
}

absl::Status read_chunks(const Database& database, rocksdb::ColumnFamilyHandle* family, const std::string& prefix,
                         const ChunkList& list, ChunkSink sink) {
  // Read all chunks from one state of the database, because another thread may replace the scene's snapshot meanwhile.
  // Get each chunk by its key instead of iterating: an iterator also reads neighbouring blocks and fails if one of them
  // is damaged, even if no chunk is stored in that block.
  rocksdb::ManagedSnapshot snapshot(&database.db());
  rocksdb::ReadOptions options = reading_options();
  options.snapshot = snapshot.snapshot();
  ChunkList found;
  rocksdb::PinnableSlice value;
  while (found.chunks < list.chunks) {
    const std::string key = chunk_key(prefix, static_cast<uint32_t>(found.chunks));
    const rocksdb::Status read = database.db().Get(options, family, key, &value);
    if (read.IsNotFound()) return damaged(absl::StrCat("chunk ", found.chunks, " is missing"));
    if (!read.ok()) return read_error(absl::StrCat("reading chunk ", found.chunks), read);
    const std::optional<absl::string_view> bytes = verified(key, view_of(value));
    if (!bytes) return damaged(absl::StrCat("chunk ", found.chunks, " does not match its checksum"));
    add_chunk(found, view_of(value));
    RETURN_IF_ERROR(sink(*bytes));
    value.Reset();
  }
  if (found == list) return absl::OkStatus();
  return damaged(
      absl::StrCat("the chunks (", found.chunks, " of ", list.chunks, ") do not match the checksum of their list"));
}

}  // namespace locus::server
