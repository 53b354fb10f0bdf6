// Checksums of stored rows, records and chunks, the same for every log: a log of one machine and a log of a cluster
// detect the same damage. Free functions on plain data; any thread.
#ifndef LOCUS_SERVER_STORAGE_ROWS_CHECKSUMS_H_
#define LOCUS_SERVER_STORAGE_ROWS_CHECKSUMS_H_

#include <array>
#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"
#include "core/scene/log/update_log.h"

namespace locus::server {

using Sha256 = std::array<uint8_t, 32>;

absl::string_view view_of(const Sha256& sha256);

// Returns the 64-bit XXH3 hash of `bytes`.
uint64_t checksum(absl::string_view bytes, uint64_t seed = 0);

// Summary of a list of chunks: their number, their size in bytes without checksums, and a hash over their checksums in
// order.
struct ChunkList {
  uint64_t chunks = 0;
  uint64_t bytes = 0;
  uint64_t digest = 0;

  // Adds a chunk of `size` bytes whose checksum is `chunk_checksum`.
  void add(size_t size, uint64_t chunk_checksum);
  bool operator==(const ChunkList&) const = default;
};

// Returns the key of a scene's record, from which its checksum is computed. Keys sort in the order of (scene,
// sequence).
std::string log_key(SceneKey scene, uint64_t sequence);
inline constexpr uint8_t kRecordFormat = 1;
// Returns the part of a stored record before its bytes: format, epoch, writer, batch number and size.
std::string record_head(const LogEntry& entry);
// Returns the running checksum after the record with this key, head and bytes. `running_checksum` is that of the record
// before, so the result depends on all earlier records.
uint64_t record_checksum(absl::string_view key, absl::string_view head, absl::string_view bytes,
                         uint64_t running_checksum);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROWS_CHECKSUMS_H_
