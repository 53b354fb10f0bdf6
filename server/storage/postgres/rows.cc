#include "server/storage/postgres/rows.h"

#include <algorithm>
#include <random>

#include "absl/strings/str_cat.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {
namespace {

RowWriter& add(RowWriter& out, const ChunkList& list) { return out.u64(list.chunks).u64(list.bytes).u64(list.digest); }

ChunkList chunk_list(const EngineRows& rows, size_t row, int column) {
  return {rows.number(row, column), rows.number(row, column + 1), rows.number(row, column + 2)};
}

}  // namespace

absl::Status damaged(absl::string_view kind, absl::string_view name, absl::string_view what) {
  return absl::DataLossError(
      absl::StrCat(kind, " '", name, "' is damaged: ", what, "; restore it from a backup of the engine, or delete it"));
}

absl::StatusOr<StoredSceneRow> scene_row(const EngineRows& rows, size_t row) {
  StoredSceneRow found;
  found.key = rows.number(row, 0);
  found.name = std::string(rows.bytes(row, 1));
  found.spec = std::string(rows.bytes(row, 2));
  found.epoch = rows.number(row, 3);
  found.apply_version = rows.number(row, 4);
  found.snapshot = rows.number(row, 5);
  found.snapshot_sequence = rows.number(row, 6);
  found.snapshot_chain = rows.number(row, 7);
  found.chunks = chunk_list(rows, row, 8);
  if (checksum_of(found) != rows.number(row, 11))
    return damaged("scene", found.name, "the checksum of its row is wrong");
  return found;
}

absl::StatusOr<StoredMeshRow> mesh_row(const EngineRows& rows, size_t row) {
  StoredMeshRow found;
  found.name = std::string(rows.bytes(row, 0));
  const absl::string_view sha256 = rows.bytes(row, 1);
  std::copy_n(sha256.begin(), std::min(sha256.size(), found.sha256.size()), found.sha256.begin());
  found.grace_s = static_cast<uint32_t>(rows.number(row, 2));
  found.content = rows.number(row, 3);
  found.chunks = chunk_list(rows, row, 4);
  if (checksum_of(found) != rows.number(row, 7)) return damaged("mesh", found.name, "the checksum of its row is wrong");
  return found;
}

StoredScene stored_scene(const EngineRows& rows, size_t row) {
  StoredScene stored;
  stored.key = rows.number(row, 0);
  stored.name = std::string(rows.bytes(row, 1));
  const absl::StatusOr<StoredSceneRow> found = scene_row(rows, row);
  stored.damage = found.status();
  if (found.ok()) {
    stored.spec = found->spec;
    stored.epoch = found->epoch;
    stored.snapshot_sequence = found->snapshot_sequence;
  }
  stored.last_sequence = rows.number(row, kSceneColumns);
  stored.log_bytes = rows.number(row, kSceneColumns + 1);
  return stored;
}

StoredMesh stored_mesh(const EngineRows& rows, size_t row) {
  StoredMesh stored;
  stored.name = std::string(rows.bytes(row, 0));
  const absl::StatusOr<StoredMeshRow> found = mesh_row(rows, row);
  stored.damage = found.status();
  if (found.ok()) {
    stored.sha256 = found->sha256;
    stored.grace_s = found->grace_s;
  }
  return stored;
}

uint64_t checksum_of(const StoredSceneRow& row) {
  RowWriter out;
  out.u64(row.key).string(row.name).string(row.spec).u64(row.epoch).u64(row.apply_version);
  out.u64(row.snapshot).u64(row.snapshot_sequence).u64(row.snapshot_chain);
  return checksum(add(out, row.chunks).view());
}

uint64_t checksum_of(const StoredMeshRow& row) {
  RowWriter out;
  out.string(row.name).bytes(view_of(row.sha256)).u32(row.grace_s).u64(row.content);
  return checksum(add(out, row.chunks).view());
}

uint64_t first_chain(SceneKey scene) { return checksum(log_key(scene, 0)); }

uint64_t chain_after(SceneKey scene, uint64_t sequence, const LogEntry& entry, uint64_t chain_before) {
  return record_checksum(log_key(scene, sequence), record_head(entry), entry.bytes, chain_before);
}

uint64_t chunk_checksum(uint64_t id, uint64_t number, absl::string_view bytes) {
  return checksum(bytes, checksum(RowWriter().u64(id).u64(number).view()));
}

uint64_t random_id() {
  std::random_device random;
  return uint64_t{random()} << 32 | random();
}

}  // namespace locus::server
