#include "server/storage/rocksdb/rows.h"

#include <algorithm>

#include "core/base/check.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {
namespace {

constexpr size_t kChecksumBytes = 8;
constexpr size_t kContentRowBytes = 4 * 8;

std::string tagged(char tag, absl::string_view rest) { return std::string(1, tag).append(rest.data(), rest.size()); }

}  // namespace

std::string scene_key(SceneKey scene) { return RowWriter().u8(kSceneTag).big_u64(scene).take(); }
std::string mesh_key(absl::string_view name) { return tagged(kMeshTag, name); }
std::string content_key(const Sha256& sha256) { return tagged(kContentTag, view_of(sha256)); }
std::string pending_snapshot_key(SceneKey scene, uint64_t content_id) {
  return RowWriter().u8(kPendingSnapshotTag).big_u64(scene).big_u64(content_id).take();
}
std::string pending_mesh_key(const Sha256& sha256, uint64_t content_id) {
  return RowWriter().u8(kPendingMeshTag).bytes(view_of(sha256)).big_u64(content_id).take();
}

std::string end_of(std::string prefix) {
  while (!prefix.empty() && prefix.back() == '\xff') prefix.pop_back();
  if (prefix.empty()) return std::string(64, '\xff');  // sorts after every key: no key begins with 64 such bytes
  prefix.back() = static_cast<char>(prefix.back() + 1);
  return prefix;
}
std::string scene_prefix(SceneKey scene) { return RowWriter().big_u64(scene).take(); }
std::string snapshot_prefix(SceneKey scene, uint64_t content_id) {
  return RowWriter().big_u64(scene).big_u64(content_id).take();
}
std::string mesh_prefix(const Sha256& sha256, uint64_t content_id) {
  return RowWriter().bytes(view_of(sha256)).big_u64(content_id).take();
}
std::string chunk_key(absl::string_view prefix, uint32_t index) {
  return RowWriter().bytes(prefix).big_u32(index).take();
}

std::string with_checksum(absl::string_view key, absl::string_view bytes) {
  std::string value;
  value.reserve(bytes.size() + kChecksumBytes);
  value.append(bytes.data(), bytes.size());
  return value.append(RowWriter().u64(checksum(bytes, checksum(key))).view());
}

std::optional<absl::string_view> verified(absl::string_view key, absl::string_view value) {
  if (value.size() < kChecksumBytes) return std::nullopt;
  const absl::string_view bytes = value.substr(0, value.size() - kChecksumBytes);
  if (stored_checksum(value) != checksum(bytes, checksum(key))) return std::nullopt;
  return bytes;
}

uint64_t stored_checksum(absl::string_view value) {
  return value.size() < kChecksumBytes ? 0 : RowReader(value.substr(value.size() - kChecksumBytes)).u64();
}

void add_chunk(ChunkList& list, absl::string_view value) {
  LOCUS_DCHECK_LE(kChecksumBytes, value.size());
  list.add(value.size() - kChecksumBytes, stored_checksum(value));
}

std::string encode(const ContentRow& row) {
  return RowWriter().u64(row.content_id).u64(row.chunks.chunks).u64(row.chunks.bytes).u64(row.chunks.digest).take();
}

std::string encode(const MeshRow& row) {
  RowWriter out;
  out.bytes(view_of(row.sha256));
  if (row.parts) out.bytes(encode(*row.parts));
  if (row.grace_s != 0) out.u32(row.grace_s);
  return out.take();
}

std::string encode(const SceneRow& row) {
  RowWriter out;
  out.u64(row.key)
      .string(row.name)
      .string(row.spec)
      .u64(row.epoch)
      .u64(row.snapshot_sequence)
      .u64(row.running_checksum);
  return out.bytes(encode(ContentRow{row.snapshot_id, row.snapshot})).take();
}

std::string encode(const CatalogueRow& row) {
  return RowWriter().u64(row.generation).u64(row.next_scene).u64(row.scene_sum).u64(row.mesh_sum).take();
}

std::optional<ContentRow> decode_content(absl::string_view bytes) {
  RowReader in(bytes);
  ContentRow row;
  row.content_id = in.u64();
  row.chunks.chunks = in.u64();
  row.chunks.bytes = in.u64();
  row.chunks.digest = in.u64();
  return in.ended() ? std::optional(row) : std::nullopt;
}

std::optional<MeshRow> decode_mesh(absl::string_view bytes) {
  RowReader in(bytes);
  MeshRow row;
  const absl::string_view sha256 = in.bytes(row.sha256.size());
  if (!in.ok()) return std::nullopt;
  std::copy(sha256.begin(), sha256.end(), row.sha256.begin());
  if (in.rest().size() >= kContentRowBytes) row.parts = decode_content(in.bytes(kContentRowBytes));
  if (in.ended()) return row;
  row.grace_s = in.u32();
  return in.ended() && row.grace_s != 0 ? std::optional(row) : std::nullopt;
}

std::optional<SceneRow> decode_scene(absl::string_view bytes) {
  RowReader in(bytes);
  SceneRow row;
  row.key = in.u64();
  row.name = in.string();
  row.spec = in.string();
  row.epoch = in.u64();
  row.snapshot_sequence = in.u64();
  row.running_checksum = in.u64();
  const std::optional<ContentRow> snapshot = decode_content(in.rest());
  if (!in.ok() || !snapshot) return std::nullopt;
  row.snapshot_id = snapshot->content_id;
  row.snapshot = snapshot->chunks;
  return row;
}

std::optional<CatalogueRow> decode_catalogue(absl::string_view bytes) {
  RowReader in(bytes);
  CatalogueRow row;
  row.generation = in.u64();
  row.next_scene = in.u64();
  row.scene_sum = in.u64();
  row.mesh_sum = in.u64();
  return in.ended() ? std::optional(row) : std::nullopt;
}

std::optional<LogEntry> decode_record(absl::string_view value) {
  RowReader in(value);
  LogEntry entry;
  const uint8_t format = in.u8();
  entry.epoch = in.u64();
  entry.writer = in.u64();
  entry.batch = in.u64();
  entry.bytes = in.bytes(in.u32());
  in.u64();
  if (!in.ended() || format != kRecordFormat) return std::nullopt;
  return entry;
}

}  // namespace locus::server
