#include "server/storage/rows/checksums.h"

#include <xxhash.h>

#include "server/storage/rows/row_codec.h"

namespace locus::server {

absl::string_view view_of(const Sha256& sha256) {
  return {reinterpret_cast<const char*>(sha256.data()), sha256.size()};
}

uint64_t checksum(absl::string_view bytes, uint64_t seed) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

void ChunkList::add(size_t size, uint64_t chunk_checksum) {
  ++chunks;
  bytes += size;
  digest = checksum(RowWriter().u64(chunk_checksum).view(), digest);
}

std::string log_key(SceneKey scene, uint64_t sequence) { return RowWriter().big_u64(scene).big_u64(sequence).take(); }

std::string record_head(const LogEntry& entry) {
  RowWriter out;
  out.u8(kRecordFormat).u64(entry.epoch).u64(entry.writer).u64(entry.batch);
  return out.u32(static_cast<uint32_t>(entry.bytes.size())).take();
}

uint64_t record_checksum(absl::string_view key, absl::string_view head, absl::string_view bytes,
                         uint64_t running_checksum) {
  return checksum(RowWriter().bytes(key).bytes(head).u64(checksum(bytes)).view(), running_checksum);
}

}  // namespace locus::server
