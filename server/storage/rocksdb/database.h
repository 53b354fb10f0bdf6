// The RocksDB database in a data directory: its column families, its open modes, and writes. After the first failed
// write every write fails until recover() succeeds.
//
// Threads: any thread may call any member, but only one thread at a time may call recover(). Other threads may call
// write() meanwhile.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_DATABASE_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_DATABASE_H_

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/base/mutex.h"
#include "rocksdb/db.h"
#include "rocksdb/options.h"
#include "server/storage/rocksdb/storage_options.h"
#include "server/storage/rocksdb/wal_watch.h"

namespace locus::server {

inline constexpr absl::string_view kDatabaseFolder = "rocksdb";
inline constexpr absl::string_view kLogFamily = "log";

enum class OpenMode : uint8_t {
  kCreate,           // creates the database
  kStrict,           // refuses damage, except a torn end of the write-ahead log
  kLenient,          // opens a damaged database too: keeps the readable parts and deletes all other parts
  kReadOnly,         // refuses damage like kStrict; changes no file
  kReadOnlyLenient,  // reads the readable parts of a damaged database; changes no file
};

struct DatabaseOptions {
  rocksdb::Env* env = nullptr;
  std::string folder;  // path of the folder rocksdb/ in the data directory
  uint64_t log_buffer_bytes = 0;
  StorageWarning warn = nullptr;
};

// Return the options of the database and of its column families (in the order meta, log, snapshot, mesh). They are
// arguments of rocksdb::DB::Open() and rocksdb::RepairDB().
rocksdb::DBOptions database_options(const DatabaseOptions& options, OpenMode mode);
std::vector<rocksdb::ColumnFamilyDescriptor> families(const DatabaseOptions& options, OpenMode mode);

class Database {
 public:
  static rocksdb::Status open(const DatabaseOptions& options, OpenMode mode, std::unique_ptr<Database>& result);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  rocksdb::DB& db() const { return *db_; }
  rocksdb::ColumnFamilyHandle* meta() const { return families_[0]; }
  rocksdb::ColumnFamilyHandle* log() const { return families_[1]; }
  rocksdb::ColumnFamilyHandle* snapshot() const { return families_[2]; }
  rocksdb::ColumnFamilyHandle* mesh() const { return families_[3]; }
  const WalWatch& wal_watch() const { return wal_watch_; }

  // Writes the batch completely or not at all. After an error every write fails with that error until recover()
  // succeeds.
  absl::Status write(rocksdb::WriteBatch& batch, bool sync) LOCUS_EXCLUDES(mutex_);
  // Syncs every earlier write.
  absl::Status sync();

  bool needs_recovery() const;
  // Resumes writing after an error. Starts a new log file, because RocksDB reads no record that follows a torn one.
  // Waits until the calls of write() in progress have returned; new calls of write() fail meanwhile. Flushes all memory
  // tables. If the disk's free space, `free_bytes`, is too small for the flush, returns RESOURCE_EXHAUSTED with the
  // bytes needed. If writes were failing already, write() then returns this error instead of the earlier error.
  absl::Status recover(uint64_t free_bytes) LOCUS_EXCLUDES(mutex_);
  // Starts flushing all memory tables, so that RocksDB can delete old log files. Returns at once; if flushing fails,
  // the next write reports the error.
  void flush_soon();
  // Waits until fewer than two full memory tables of `family` are waiting to be flushed. If all memory tables of a
  // family were full, RocksDB would stall all writers.
  void wait_for_buffers(rocksdb::ColumnFamilyHandle* family) const;
  // Returns the total size in bytes of the memory tables of all column families that are not flushed yet.
  uint64_t buffered_bytes() const;
  // Returns the size in bytes of RocksDB's block cache, which keeps blocks of tables in memory.
  uint64_t block_cache_bytes() const;

 private:
  class ErrorWatch;

  Database(OpenMode mode);
  absl::Status write_now(rocksdb::WriteBatch& batch, bool sync) LOCUS_EXCLUDES(mutex_);
  // Makes every write fail until recover() succeeds. Returns the error of these writes: `status` converted by
  // disk_error() or, if `status` is OK, the earlier error.
  absl::Status fail_writes(const rocksdb::Status& status) LOCUS_EXCLUDES(mutex_);
  // Waits until a scheduled flush has started or there is none, for at most about ten seconds. RocksDB 7.8 drops a
  // flush that starts after an error stopped background work, but keeps the column family marked as queued, so that no
  // later flush of the family, not even the one of Resume(), ever starts. `called_by_flush`: the caller is possibly the
  // thread of a running flush, for which a pending flush waits.
  void wait_for_flush_start(bool called_by_flush) const;
  // Writes a row with the key kFamilyMark into the memory table of every family, bypassing the write-ahead log, and
  // flushes all families. Afterwards no earlier log file is needed.
  rocksdb::Status flush_to_new_log();

  const OpenMode mode_;
  WalWatch wal_watch_;
  std::shared_ptr<ErrorWatch> errors_;
  std::unique_ptr<rocksdb::Env> env_;  // declared before db_, which uses the Env until it is destroyed
  std::unique_ptr<rocksdb::DB> db_;
  std::vector<rocksdb::ColumnFamilyHandle*> families_;
  std::atomic<bool> broken_ = false;
  std::atomic<int> writers_ = 0;  // number of calls of write_now() in progress
  Mutex lenient_;  // serializes writes in the lenient modes, where RocksDB would accept a write after a failed write
  mutable Mutex mutex_;
  absl::Status error_ LOCUS_GUARDED_BY(mutex_);  // error that write() returns while broken_ is set
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_DATABASE_H_
