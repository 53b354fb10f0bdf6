#include "server/storage/rocksdb/database.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>
#include <utility>

#include "absl/strings/ascii.h"
#include "core/base/check.h"
#include "rocksdb/listener.h"
#include "rocksdb/table.h"
#include "server/storage/rocksdb/errors.h"
#include "server/storage/rocksdb/rows.h"
#include "server/storage/rocksdb/table_guard.h"

namespace locus::server {
namespace {

constexpr uint64_t kTableBytes = uint64_t{32} << 20;  // size of a memory table of family snapshot or mesh
constexpr uint64_t kMetaBytes = uint64_t{4} << 20;    // size of a memory table of family meta
constexpr size_t kBlockBytes = size_t{64} << 10;
constexpr size_t kCacheBytes = size_t{8} << 20;
constexpr int kBuffers = 4;
// Numbers of tables in RocksDB's level 0. RocksDB merges the tables once there are kTablesToMerge of them, and would
// stall writers once there are kUnlimitedTables. A stall would only delay updates, so kUnlimitedTables is so large that
// it is never reached.
constexpr int kTablesToMerge = 4;
constexpr int kUnlimitedTables = 1 << 20;
constexpr uint64_t kManifestBytes = uint64_t{4} << 20;
constexpr size_t kMaxWarning = 1024;  // maximum bytes of a message of RocksDB; longer ones are cut
constexpr uint64_t kLogBuffersOnDisk = 4;
// Disk space in bytes that recover() needs in addition to the size of the memory tables.
constexpr uint64_t kRecoveryBytes = uint64_t{1} << 20;
constexpr auto kBufferPoll = std::chrono::milliseconds(1);
constexpr int kFlushStartPolls =
    10'000;  // maximum number of polls, at intervals of kBufferPoll, for the start of a flush

// Passes RocksDB's warnings and errors to a function. Without this logger RocksDB would write them to a text file in
// the database's folder. The read-only modes must not write a file. And if the disk is full and RocksDB 7.8 could not
// write a message to that file, it aborts the process at the next message.
class WarningLogger final : public rocksdb::Logger {
 public:
  explicit WarningLogger(StorageWarning warn) : Logger(rocksdb::InfoLogLevel::WARN_LEVEL), warn_(std::move(warn)) {}

  using rocksdb::Logger::Logv;
  void Logv(const char* format, va_list arguments) override {
    if (!warn_) return;
    char text[kMaxWarning];
    if (std::vsnprintf(text, sizeof text, format, arguments) > 0) warn_(absl::StripTrailingAsciiWhitespace(text));
  }

 private:
  const StorageWarning warn_;
};

bool read_only(OpenMode mode) { return mode == OpenMode::kReadOnly || mode == OpenMode::kReadOnlyLenient; }
bool lenient(OpenMode mode) { return mode == OpenMode::kLenient || mode == OpenMode::kReadOnlyLenient; }

rocksdb::ColumnFamilyOptions family_options(uint64_t buffer_bytes, OpenMode mode) {
  rocksdb::ColumnFamilyOptions options;
  options.write_buffer_size = buffer_bytes;
  options.max_write_buffer_number = kBuffers;
  options.compression = rocksdb::kNoCompression;
  options.level0_file_num_compaction_trigger = kTablesToMerge;
  options.level0_slowdown_writes_trigger = kUnlimitedTables;
  options.level0_stop_writes_trigger = kUnlimitedTables;
  options.soft_pending_compaction_bytes_limit = 0;
  options.hard_pending_compaction_bytes_limit = 0;
  // Do not compact a damaged database: if a compaction failed to read a damaged block, RocksDB would stop all writes.
  options.disable_auto_compactions = lenient(mode);
  rocksdb::BlockBasedTableOptions table;
  table.block_size = kBlockBytes;
  table.checksum = rocksdb::kXXH3;
  table.block_cache = rocksdb::NewLRUCache(kCacheBytes);
  options.table_factory.reset(rocksdb::NewBlockBasedTableFactory(table));
  return options;
}

// Returns true if the thread of a running flush may have reported an error of this kind.
bool may_come_from_flush(rocksdb::BackgroundErrorReason reason) {
  using Reason = rocksdb::BackgroundErrorReason;
  return reason != Reason::kWriteCallback && reason != Reason::kMemTable && reason != Reason::kCompaction;
}

}  // namespace

// Listener that lets recover(), and nothing else, resume the database after every disk error. Without this listener
// RocksDB would refuse writes until the process ends (after severe errors) or retry by itself every five seconds (after
// all other errors).
class Database::ErrorWatch final : public rocksdb::EventListener {
 public:
  std::atomic<bool> seen = false;
  std::atomic<bool> seen_again = false;  // a further error came before recover()

  // Sets the database whose flushes the first error waits for; null until the database is open, during recover(), and
  // once it closes. Returns when no thread of RocksDB uses the earlier database any more.
  void watch(const Database* database) LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    database_ = database;
  }

  // RocksDB calls this function before it stops background work because of the error, without holding its mutex.
  void OnBackgroundError(rocksdb::BackgroundErrorReason reason, rocksdb::Status* error) override
      LOCUS_EXCLUDES(mutex_) {
    if (!seen.exchange(true)) {
      MutexLock lock(mutex_);
      if (database_ != nullptr) database_->wait_for_flush_start(may_come_from_flush(reason));
    } else {
      seen_again = true;
    }
    if (error->IsIOError() && !error->IsIOFenced() && error->severity() > rocksdb::Status::Severity::kHardError)
      *error = rocksdb::Status(*error, rocksdb::Status::Severity::kHardError);
  }
  void OnErrorRecoveryBegin(rocksdb::BackgroundErrorReason, rocksdb::Status, bool* automatically) override {
    *automatically = false;
  }

 private:
  Mutex mutex_;  // held while a thread of RocksDB uses the database
  const Database* database_ LOCUS_GUARDED_BY(mutex_) = nullptr;
};

rocksdb::DBOptions database_options(const DatabaseOptions& options, OpenMode mode) {
  rocksdb::DBOptions found;
  found.create_if_missing = mode == OpenMode::kCreate;
  found.create_missing_column_families = mode == OpenMode::kCreate;
  found.paranoid_checks = !lenient(mode);
  // RocksDB's default, point-in-time recovery, silently drops all records after the first unreadable one.
  found.wal_recovery_mode = lenient(mode) ? rocksdb::WALRecoveryMode::kSkipAnyCorruptedRecords
                                          : rocksdb::WALRecoveryMode::kTolerateCorruptedTailRecords;
  // Keep the log files after reading them, because flushing their records into tables would double the time to the
  // first query. Flushing is not needed for durability: open_directory() has synced the log files. Only kLenient
  // flushes, so that RocksDB can delete a log file with an unreadable part.
  found.avoid_flush_during_recovery = mode != OpenMode::kLenient;
  // Leave off the option track_and_verify_wals_in_manifest of RocksDB 7.8, which records in the MANIFEST how far each
  // log was synced. If a database was opened with the option and was damaged later, opening it read-only without the
  // option ends the process by an assertion. The durable marker detects the same damage.
  found.max_total_wal_size = kLogBuffersOnDisk * options.log_buffer_bytes;
  found.max_manifest_file_size = kManifestBytes;
  found.info_log = std::make_shared<WarningLogger>(options.warn);
  found.stats_dump_period_sec = 0;
  found.stats_persist_period_sec = 0;
  found.skip_stats_update_on_db_open = true;
  found.max_file_opening_threads = 1;  // the default starts many threads to open a few files
  return found;
}

std::vector<rocksdb::ColumnFamilyDescriptor> families(const DatabaseOptions& options, OpenMode mode) {
  const uint64_t chunk_buffer = std::min(kTableBytes, options.log_buffer_bytes);
  return {{rocksdb::kDefaultColumnFamilyName, family_options(std::min(kMetaBytes, options.log_buffer_bytes), mode)},
          {std::string(kLogFamily), family_options(options.log_buffer_bytes, mode)},
          {"snapshot", family_options(chunk_buffer, mode)},
          {"mesh", family_options(chunk_buffer, mode)}};
}

Database::Database(OpenMode mode)
    : mode_(mode),
      wal_watch_(lenient(mode) ? AtGap::kContinue : AtGap::kRefuse),
      errors_(std::make_shared<ErrorWatch>()) {}

rocksdb::Status Database::open(const DatabaseOptions& options, OpenMode mode, std::unique_ptr<Database>& result) {
  std::unique_ptr<Database> database(new Database(mode));
  rocksdb::DBOptions wanted = database_options(options, mode);
  database->env_ = rocksdb::NewCompositeEnv(std::make_shared<TableGuard>(options.env->GetFileSystem()));
  wanted.env = database->env_.get();
  wanted.wal_filter = &database->wal_watch_;
  wanted.listeners = {database->errors_};
  rocksdb::Status status;
  // RocksDB would create the folder too, but would first report the missing folder as an error.
  if (mode == OpenMode::kCreate) status = wanted.env->CreateDirIfMissing(options.folder);
  if (!status.ok()) return status;
  rocksdb::DB* db = nullptr;
  status =
      read_only(mode)
          ? rocksdb::DB::OpenForReadOnly(wanted, options.folder, families(options, mode), &database->families_, &db)
          : rocksdb::DB::Open(wanted, options.folder, families(options, mode), &database->families_, &db);
  if (!status.ok()) return status;
  database->db_.reset(db);
  database->errors_->watch(database.get());
  result = std::move(database);
  if (mode == OpenMode::kCreate) status = result->flush_to_new_log();
  return status;
}

Database::~Database() {
  LOCUS_DCHECK_EQ(writers_.load(), 0);
  errors_->watch(nullptr);
  if (db_ == nullptr) return;
  for (rocksdb::ColumnFamilyHandle* family : families_) db_->DestroyColumnFamilyHandle(family).PermitUncheckedError();
  db_->Close().PermitUncheckedError();
}

absl::Status Database::write(rocksdb::WriteBatch& batch, bool sync) {
  if (!lenient(mode_)) return write_now(batch, sync);
  MutexLock lock(lenient_);
  return write_now(batch, sync);
}

absl::Status Database::write_now(rocksdb::WriteBatch& batch, bool sync) {
  ++writers_;
  rocksdb::Status status;
  const bool broken = broken_;
  if (!broken) {
    rocksdb::WriteOptions options;
    options.sync = sync;
    status = db_->Write(options, &batch);
  }
  absl::Status error;
  if (broken || !status.ok()) error = fail_writes(status);
  LOCUS_DCHECK_LT(0, writers_.load());
  --writers_;
  return error;
}

absl::Status Database::fail_writes(const rocksdb::Status& status) {
  MutexLock lock(mutex_);
  if (!status.ok()) error_ = disk_error("writing the log", status);
  broken_ = true;
  return error_;
}

// Uses an empty synced write instead of RocksDB's SyncWAL(), which aborts the process if another thread's write has
// just failed.
absl::Status Database::sync() {
  rocksdb::WriteBatch empty;
  return write(empty, true);
}

bool Database::needs_recovery() const { return broken_ || errors_->seen; }

absl::Status Database::recover(uint64_t free_bytes) {
  if (const uint64_t needed = buffered_bytes() + kRecoveryBytes; free_bytes < needed) {
    absl::Status refusal = refuse_recovery(needed, free_bytes);
    MutexLock lock(mutex_);
    if (broken_) error_ = refusal;
    return refusal;
  }
  if (!broken_) fail_writes(rocksdb::Status::IOError("a table could not be written")).IgnoreError();
  // RocksDB aborts the process if it writes to a log file in which an earlier write failed. Resume() permits writes
  // again before flush_to_new_log() has replaced this log file. Therefore wait until no call of write_now() is in
  // progress.
  while (writers_ > 0) std::this_thread::sleep_for(kBufferPoll);
  errors_->watch(nullptr);
  errors_->seen = false;
  errors_->seen_again = false;
  rocksdb::Status status = db_->Resume();
  // If the memory tables are empty, Resume() flushes nothing and keeps the log file in which a write failed. Then
  // flush_to_new_log() fails too, but leaves a row in the memory tables, so that the next call of recover() succeeds.
  if (status.ok()) status = flush_to_new_log();
  errors_->watch(this);
  if (!status.ok()) {
    errors_->seen = true;
    MutexLock lock(mutex_);
    error_ = disk_error("resuming after an error", status);
    return error_;
  }
  MutexLock lock(mutex_);
  error_ = absl::OkStatus();
  broken_ = false;
  return absl::OkStatus();
}

rocksdb::Status Database::flush_to_new_log() {
  rocksdb::WriteBatch batch;
  const absl::string_view key(kFamilyMark);
  const std::string value = with_checksum(key, "");
  rocksdb::Status status;
  for (rocksdb::ColumnFamilyHandle* family : families_) {
    if (status.ok()) status = batch.Put(family, rocksdb::Slice(key.data(), key.size()), value);
  }
  rocksdb::WriteOptions without_wal;
  without_wal.disableWAL = true;
  if (status.ok()) status = db_->Write(without_wal, &batch);
  if (status.ok()) status = db_->Flush(rocksdb::FlushOptions(), families_);
  return status;
}

void Database::flush_soon() {
  rocksdb::FlushOptions options;
  options.wait = false;
  options.allow_write_stall = true;
  db_->Flush(options, families_).PermitUncheckedError();
}

void Database::wait_for_buffers(rocksdb::ColumnFamilyHandle* family) const {
  uint64_t waiting = 0;
  while (!needs_recovery() && db_->GetIntProperty(family, rocksdb::DB::Properties::kNumImmutableMemTable, &waiting) &&
         waiting >= 2)
    std::this_thread::sleep_for(kBufferPoll);
}

void Database::wait_for_flush_start(bool called_by_flush) const {
  const auto waits_for_start = [&] {
    uint64_t running = 0;
    uint64_t pending = 0;
    if (errors_->seen_again) return false;  // the running flush failed: RocksDB schedules no other one
    // While a flush runs, a pending one is not scheduled. If the running flush is the caller, background work stops
    // before it ends, and the pending flush waits for Resume(). Any other running flush may end just before background
    // work stops, so that the pending flush is scheduled and then dropped.
    if (called_by_flush && (!db_->GetIntProperty(rocksdb::DB::Properties::kNumRunningFlushes, &running) || running > 0))
      return false;
    return std::any_of(families_.begin(), families_.end(), [&](rocksdb::ColumnFamilyHandle* family) {
      return db_->GetIntProperty(family, rocksdb::DB::Properties::kMemTableFlushPending, &pending) && pending > 0;
    });
  };
  for (int polls = 0; polls < kFlushStartPolls && waits_for_start(); ++polls) std::this_thread::sleep_for(kBufferPoll);
}

uint64_t Database::block_cache_bytes() const {
  uint64_t bytes = 0;
  return db_->GetIntProperty(rocksdb::DB::Properties::kBlockCacheUsage, &bytes) ? bytes : 0;
}

uint64_t Database::buffered_bytes() const {
  uint64_t bytes = 0;
  return db_->GetAggregatedIntProperty(rocksdb::DB::Properties::kCurSizeAllMemTables, &bytes) ? bytes : 0;
}

}  // namespace locus::server
