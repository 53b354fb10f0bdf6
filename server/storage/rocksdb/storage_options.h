// Options for opening a data directory. Plain data.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_STORAGE_OPTIONS_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_STORAGE_OPTIONS_H_

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "absl/strings/string_view.h"

namespace rocksdb {
class Env;
}

namespace locus::server {

// Receives the warnings and errors that RocksDB logs, one line of text each. RocksDB calls the function on any thread,
// possibly while RocksDB holds locks: the function must not call the RocksdbLog.
using StorageWarning = std::function<void(absl::string_view)>;

struct StorageOptions {
  // Data directory; created if it is missing. One process at a time may have it open.
  std::string path;

  // File system, borrowed; null = the machine's file system. Tests pass a file system that injects faults.
  rocksdb::Env* env = nullptr;

  // Bytes of disk space that append() leaves free, so that snapshots (which shorten the log) and RocksDB's own files
  // can still be written. No value = 64 MiB or 5 % of the disk, whichever is less.
  std::optional<uint64_t> reserve_bytes;

  // Size in bytes of RocksDB's memory table for log records. With a larger table, snapshots delete more records before
  // RocksDB writes them to the disk a second time, in a table file. But after a crash the daemon must then read a
  // longer write-ahead log when it starts.
  uint64_t log_buffer_bytes = uint64_t{64} << 20;

  // Maximum delay between the append of a record with AckLevel::kMemory and the sync of that record.
  std::chrono::milliseconds memory_sync_delay{50};

  // Delay between a sync of the log and the update of the durable marker. If records that were synced within this time
  // before a crash are later missing at the end of the log, the loss is not detected.
  std::chrono::milliseconds durable_marker_delay{10};

  // Receives RocksDB's warnings. If the function is empty, the warnings are dropped.
  StorageWarning warn;

  // If false, records and changes of the catalogue are acknowledged without a sync. Only for tests, which show with
  // this option that they detect lost records.
  bool sync = true;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_STORAGE_OPTIONS_H_
