// How a data directory is opened: the options as documentation. Plain data.
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
  // The data directory, which is made where it is missing. One process at a time has it open.
  std::string path;

  // The files beneath; the machine's own where null. Tests put faults here. Borrowed.
  rocksdb::Env* env = nullptr;

  // Room on the disk that appending leaves alone, so that snapshots, which free what the log takes, and RocksDB's own
  // files still find some. 64 MiB or 5 % of the disk, whichever is less, where nothing is given.
  std::optional<uint64_t> reserve_bytes;

  // What the log may take in memory before RocksDB writes it into tables of its own. What is larger is written twice
  // less often, and takes longer to read when a killed daemon starts again.
  uint64_t log_buffer_bytes = uint64_t{64} << 20;

  // Records of AckLevel::kMemory are on the disk so long after they were appended.
  std::chrono::milliseconds memory_sync_delay{50};

  // HIGH_WATER says so long after a sync what was synced: the time before a crash for which a cut log is not noticed.
  std::chrono::milliseconds high_water_delay{10};

  // For the tests that show that they would see a loss: false acknowledges what is not on the disk.
  bool sync = true;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_STORAGE_OPTIONS_H_
