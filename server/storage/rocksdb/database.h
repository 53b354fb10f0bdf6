// The RocksDB database in a data directory: its column families, its open modes, and writes. After the first failed
// write every write fails until recover() succeeds.
//
// Threads: any thread may call any member; recover() one thread at a time, others may write meanwhile.
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
#include "server/storage/rocksdb/wal_watch.h"

namespace locus::server {

inline constexpr absl::string_view kDatabaseFolder = "rocksdb";
inline constexpr absl::string_view kLogFamily = "log";

enum class OpenMode : uint8_t {
  kCreate,           // creates the database
  kStrict,           // refuses damage, except a torn end of the write-ahead log
  kLenient,          // reads every readable part and drops the rest for good
  kReadOnly,         // kStrict without changing any file
  kReadOnlyLenient,  // kLenient without changing any file
};

struct DatabaseOptions {
  rocksdb::Env* env = nullptr;
  std::string folder;  // rocksdb/ below the data directory
  uint64_t log_buffer_bytes = 0;
};

// Return the options of the database and of its column families (in the order meta, log, snapshot, mesh), for opening
// and for rocksdb::RepairDB().
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
  // Resumes writing after an error, in a new log file, so that no record follows a torn one. Waits until calls of
  // write() in progress have returned; calls made meanwhile fail.
  absl::Status recover() LOCUS_EXCLUDES(mutex_);
  // Starts flushing all memory tables, so that log files can be deleted. Returns at once; if flushing fails, the next
  // write reports the error.
  void flush_soon();
  // Waits until fewer than two full memory tables of the family wait to be flushed. RocksDB would stall all writers if
  // all memory tables of the family were full.
  void wait_for_buffers(rocksdb::ColumnFamilyHandle* family) const;
  // Returns the bytes in memory tables that are not flushed.
  uint64_t buffered_bytes() const;

 private:
  class ErrorWatch;

  Database(OpenMode mode);
  absl::Status write_now(rocksdb::WriteBatch& batch, bool sync) LOCUS_EXCLUDES(mutex_);
  // Makes every write fail from now on. Returns the error with which they fail.
  absl::Status fail_writes(const rocksdb::Status& status) LOCUS_EXCLUDES(mutex_);
  // Puts kFamilyMark into every family, without the write-ahead log, and flushes all families. After that no earlier
  // log file is needed.
  rocksdb::Status flush_to_new_log();

  const OpenMode mode_;
  WalWatch wal_watch_;
  std::shared_ptr<ErrorWatch> errors_;
  std::unique_ptr<rocksdb::Env> env_;  // declared before db_, which uses it
  std::unique_ptr<rocksdb::DB> db_;
  std::vector<rocksdb::ColumnFamilyHandle*> families_;
  std::atomic<bool> broken_ = false;
  std::atomic<int> writers_ = 0;  // number of calls of write_now() in progress
  Mutex lenient_;  // serializes writes in the lenient modes, in which RocksDB would accept writes after a failed one
  mutable Mutex mutex_;
  absl::Status error_ LOCUS_GUARDED_BY(mutex_);  // error of the write that set broken_
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_DATABASE_H_
