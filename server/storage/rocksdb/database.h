// The RocksDB database in a data directory: its column families, the ways it is opened, and writing that stops at the
// first error until the database has been brought in order again.
//
// Threads: write() from any thread; recover() and renew() by one at a time, others may write meanwhile.
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
  kCreate,           // a new one
  kStrict,           // refuses what does not hold together, but for a torn end of its log
  kLenient,          // reads what can be read and drops the rest for good
  kReadOnly,         // strict, and not a byte is changed
  kReadOnlyLenient,  // lenient, and not a byte is changed
};

struct DatabaseOptions {
  rocksdb::Env* env = nullptr;
  std::string folder;  // the database's own
  uint64_t log_buffer_bytes = 0;
};

// Options of the database and of its families, meta first, for whatever opens or repairs it.
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

  // All or nothing. After an error every write fails with it until recover() succeeds.
  absl::Status write(rocksdb::WriteBatch& batch, bool sync) LOCUS_EXCLUDES(mutex_);
  // What was written before the call is on the disk.
  absl::Status sync();

  bool needs_recovery() const;
  // After an error: goes on in a new log, so that nothing is written behind a torn record.
  absl::Status recover() LOCUS_EXCLUDES(mutex_);
  // Into tables, so that logs can leave the disk. In the background; an error shows up in the next write.
  void flush_soon();
  // Returns once less than two of a family's buffers wait for the disk: filling them would make all writers wait.
  void wait_for_buffers(rocksdb::ColumnFamilyHandle* family) const;
  // What waits in memory to be written into tables.
  uint64_t buffered_bytes() const;

 private:
  class ErrorWatch;

  Database(OpenMode mode);
  absl::Status write_now(rocksdb::WriteBatch& batch, bool sync) LOCUS_EXCLUDES(mutex_);
  // Writes fail from now on; the error they fail with.
  absl::Status break_with(const rocksdb::Status& status) LOCUS_EXCLUDES(mutex_);
  // Marks in every family, past the log, and all into tables: after this the logs before are not needed.
  rocksdb::Status renew();

  const OpenMode mode_;
  WalWatch wal_watch_;
  std::shared_ptr<ErrorWatch> errors_;
  std::unique_ptr<rocksdb::Env> env_;  // before what uses it
  std::unique_ptr<rocksdb::DB> db_;
  std::vector<rocksdb::ColumnFamilyHandle*> families_;
  std::atomic<bool> broken_ = false;
  std::atomic<int> writers_ = 0;  // that are at work
  Mutex lenient_;                 // held by every write to a lenient database, which would go on after an error
  mutable Mutex mutex_;
  absl::Status error_ LOCUS_GUARDED_BY(mutex_);  // of the write that broke it
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_DATABASE_H_
