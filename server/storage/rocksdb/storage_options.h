// Options for opening a data directory. Plain data.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_STORAGE_OPTIONS_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_STORAGE_OPTIONS_H_

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace rocksdb {
class Env;
}

namespace locus::server {

struct StorageOptions {
  // Data directory; created if it is missing. One process at a time may have it open.
  std::string path;

  // File system; null = that of the machine. Tests inject faults here. Borrowed.
  rocksdb::Env* env = nullptr;

  // Free disk space that appending leaves unused, so that snapshots (which shorten the log) and RocksDB's own files can
  // still be written. Default: 64 MiB or 5 % of the disk, whichever is less.
  std::optional<uint64_t> reserve_bytes;

  // Size in bytes of RocksDB's memory table for log records. If it is larger, snapshots drop more records before these
  // are written a second time, into a table; but after a kill the daemon must read more of the log when it starts.
  uint64_t log_buffer_bytes = uint64_t{64} << 20;

  // Maximum delay between the append of an AckLevel::kMemory record and its sync.
  std::chrono::milliseconds memory_sync_delay{50};

  // Delay between a sync of the log and the update of the durable marker. A log that loses its end is not detected if
  // the lost records were synced within this time before a crash.
  std::chrono::milliseconds durable_marker_delay{10};

  // If false, records are acknowledged without being synced. For tests that check that they detect lost records.
  bool sync = true;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_STORAGE_OPTIONS_H_
