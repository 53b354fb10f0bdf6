// Members of RocksdbLog that change the catalogue (the rows of scenes and meshes), or write and read the chunks of
// snapshots and meshes.
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/storage/rocksdb/errors.h"
#include "server/storage/rocksdb/reading.h"
#include "server/storage/rocksdb_log.h"
#include "server/storage/rows/refusals.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {
namespace {

// Size in bytes from which a batch of chunks is written. With larger batches, concurrent appends would wait longer for
// the disk.
constexpr size_t kChunkBatchBytes = size_t{2} << 20;
// Minimum total size in bytes of RocksDB's memory tables for which write_snapshot() starts a flush. After the flush
// RocksDB deletes old log files.
constexpr uint64_t kBufferedWorthFlushing = uint64_t{8} << 20;

// Returns a random id for the chunks of a snapshot or mesh. Ids are never reused.
uint64_t new_content_id() {
  std::random_device random;
  return uint64_t{random()} << 32 | random();
}

CatalogueChange change_of(const SceneRow& row) { return {{{scene_key(row.key), encode(row)}}, 0}; }

}  // namespace

absl::Status RocksdbLog::commit(const CatalogueChange& change, rocksdb::WriteBatch& batch) {
  catalogue_.add_to(batch, database_->meta(), change);
  absl::Status status = database_->write(batch, options_.sync);
  if (status.ok()) {
    catalogue_.apply(change);
  } else {
    catalogue_.fail(change);
  }
  return status;
}

absl::StatusOr<SceneRow> RocksdbLog::row_of(SceneKey scene) const {
  const std::optional<absl::string_view> bytes = catalogue_.find(scene_key(scene));
  std::optional<SceneRow> row = bytes ? decode_scene(*bytes) : std::nullopt;
  if (!row) return scene_not_stored(scene);
  return *std::move(row);
}

uint64_t RocksdbLog::row_checksum_of(SceneKey scene) const {
  const auto row = catalogue_.rows().find(scene_key(scene));
  return row == catalogue_.rows().end() ? 0 : stored_checksum(row->second);
}

absl::StatusOr<ChunkList> RocksdbLog::put_chunks(rocksdb::ColumnFamilyHandle* family, const std::string& pending,
                                                 const std::string& prefix, ChunkSource source) {
  ChunkList list;
  rocksdb::WriteBatch batch;
  LOCUS_CHECK(batch.Put(database_->meta(), pending, with_checksum(pending, "")).ok());
  absl::Status status;
  while (status.ok()) {
    const absl::StatusOr<std::optional<std::string>> chunk = source();
    if (!chunk.ok()) status = chunk.status();
    if (chunk.ok() && *chunk && (*chunk)->size() > kMaxChunkBytes) status = refuse_chunk((*chunk)->size());
    if (!status.ok()) break;
    if (*chunk) {
      const std::string key = chunk_key(prefix, static_cast<uint32_t>(list.chunks));
      const std::string value = with_checksum(key, **chunk);
      add_chunk(list, value);
      LOCUS_CHECK(batch.Put(family, key, value).ok());
    }
    if (*chunk && batch.GetDataSize() < kChunkBatchBytes) continue;
    database_->wait_for_buffers(family);
    // Do not sync: the later commit() that adds these chunks to the catalogue syncs the same RocksDB log.
    status = database_->write(batch, false);
    batch.Clear();
    if (status.ok() && !*chunk) return list;
  }
  drop_chunks(family, pending, prefix);
  return status;
}

void RocksdbLog::drop_chunks(rocksdb::ColumnFamilyHandle* family, const std::string& pending,
                             const std::string& prefix) {
  rocksdb::WriteBatch batch;
  LOCUS_CHECK(batch.Delete(database_->meta(), pending).ok());
  LOCUS_CHECK(batch.DeleteRange(family, prefix, end_of(prefix)).ok());
  // If this write fails, the row `pending` remains, and the next opening deletes the chunks.
  database_->write(batch, false).IgnoreError();
}

absl::StatusOr<SceneKey> RocksdbLog::create_scene(absl::string_view name, absl::string_view spec, uint64_t epoch,
                                                  ChunkSource state) {
  RETURN_IF_ERROR(check_free_space("a new scene", spec.size()));
  if (scenes_.size() >= limits::kMaxScenes)
    return refuse_full("", "scenes", limits::kMaxScenes, static_cast<double>(scenes_.size() + 1), 0);
  SceneRow row;
  {
    MutexLock lock(catalogue_mutex_);
    row.key = next_scene_++;
  }
  row.name = std::string(name);
  row.spec = std::string(spec);
  row.epoch = epoch;
  row.snapshot_id = new_content_id();
  row.running_checksum = checksum(scene_key(row.key));
  const std::string pending = pending_snapshot_key(row.key, row.snapshot_id);
  const std::string prefix = snapshot_prefix(row.key, row.snapshot_id);
  ASSIGN_OR_RETURN(ChunkList chunks, put_chunks(database_->snapshot(), pending, prefix, state));
  row.snapshot = chunks;
  {
    MutexLock lock(catalogue_mutex_);
    absl::Status status;
    if (scenes_.has_name(name)) status = scene_already_stored(name);
    if (status.ok()) {
      CatalogueChange change = change_of(row);
      change.next_scene = next_scene_;
      rocksdb::WriteBatch batch;
      LOCUS_CHECK(batch.Delete(database_->meta(), pending).ok());
      status = commit(change, batch);
    }
    if (!status.ok()) {
      drop_chunks(database_->snapshot(), pending, prefix);
      return status;
    }
    auto log_state = std::make_shared<SceneLogState>();
    log_state->key = row.key;
    log_state->name = row.name;
    log_state->written = log_state->synced = {0, row.running_checksum};
    SceneLogState& scene = *log_state;
    scenes_.add(std::move(log_state));
    scenes_.set_row(scene, row, row_checksum_of(row.key), catalogue_.totals());
    write_durable_marker(false);
  }
  return row.key;
}

absl::Status RocksdbLog::delete_scene(SceneKey key) {
  const SceneLogStatePtr log_state = scenes_.find_any(key);
  if (log_state == nullptr) return scene_not_stored(key);
  MutexLock writing(log_state->writing);
  MutexLock lock(catalogue_mutex_);
  rocksdb::WriteBatch batch;
  const std::string prefix = scene_prefix(key);
  LOCUS_CHECK(batch.DeleteRange(database_->log(), prefix, end_of(prefix)).ok());
  LOCUS_CHECK(batch.DeleteRange(database_->snapshot(), prefix, end_of(prefix)).ok());
  RETURN_IF_ERROR(commit({{{scene_key(key), std::nullopt}}, 0}, batch));
  scenes_.remove(key, catalogue_.totals());
  write_durable_marker(false);
  return absl::OkStatus();
}

absl::Status RocksdbLog::restart_scene(SceneKey key, uint64_t epoch) {
  return change_row(key, [epoch](SceneRow& row) { row.epoch = epoch; });
}

absl::Status RocksdbLog::set_scene_spec(SceneKey key, absl::string_view spec) {
  RETURN_IF_ERROR(check_free_space("the settings of a scene", spec.size()));
  return change_row(key, [spec](SceneRow& row) { row.spec = std::string(spec); });
}

absl::Status RocksdbLog::change_row(SceneKey key, absl::FunctionRef<void(SceneRow&)> change) {
  ASSIGN_OR_RETURN(const SceneLogStatePtr log_state, scenes_.find(key));
  MutexLock writing(log_state->writing);
  MutexLock lock(catalogue_mutex_);
  ASSIGN_OR_RETURN(SceneRow row, row_of(key));
  change(row);
  rocksdb::WriteBatch batch;
  RETURN_IF_ERROR(commit(change_of(row), batch));
  scenes_.set_row(*log_state, row, row_checksum_of(key), catalogue_.totals());
  write_durable_marker(false);
  return absl::OkStatus();
}

absl::Status RocksdbLog::write_snapshot(SceneKey key, uint64_t sequence, ChunkSource state) {
  ASSIGN_OR_RETURN(const SceneLogStatePtr log_state, scenes_.find(key));
  uint64_t replaced_id = 0;
  {
    MutexLock lock(catalogue_mutex_);
    ASSIGN_OR_RETURN(const SceneRow row, row_of(key));
    const uint64_t last = scenes_.last_of(*log_state);
    if (sequence < row.snapshot_sequence || sequence > last)
      return refuse_snapshot_at(sequence, row.snapshot_sequence, last);
    replaced_id = row.snapshot_id;
  }
  const uint64_t content_id = new_content_id();
  const std::string pending = pending_snapshot_key(key, content_id);
  const std::string prefix = snapshot_prefix(key, content_id);
  ASSIGN_OR_RETURN(const ChunkList chunks, put_chunks(database_->snapshot(), pending, prefix, state));
  absl::Status status = put_snapshot(log_state, replaced_id, sequence, {content_id, chunks});
  if (!status.ok()) {
    drop_chunks(database_->snapshot(), pending, prefix);
    return status;
  }
  if (database_->buffered_bytes() >= kBufferedWorthFlushing) database_->flush_soon();
  return absl::OkStatus();
}

absl::Status RocksdbLog::put_snapshot(const SceneLogStatePtr& log_state, uint64_t replaced_id, uint64_t sequence,
                                      const ContentRow& snapshot) {
  MutexLock lock(catalogue_mutex_);
  const SceneKey key = log_state->key;
  ASSIGN_OR_RETURN(SceneRow row, row_of(key));
  if (row.snapshot_id != replaced_id)
    return absl::AbortedError(absl::StrCat("another snapshot of scene '", row.name, "' was written at the same time"));
  ASSIGN_OR_RETURN(const uint64_t running_checksum, running_checksum_at(row, sequence));
  const std::string dropped = snapshot_prefix(key, replaced_id);
  row.snapshot_id = snapshot.content_id;
  row.snapshot_sequence = sequence;
  row.running_checksum = running_checksum;
  row.snapshot = snapshot.chunks;
  rocksdb::WriteBatch batch;
  LOCUS_CHECK(batch.Delete(database_->meta(), pending_snapshot_key(key, snapshot.content_id)).ok());
  LOCUS_CHECK(batch.DeleteRange(database_->snapshot(), dropped, end_of(dropped)).ok());
  LOCUS_CHECK(batch.DeleteRange(database_->log(), scene_prefix(key), log_key(key, sequence + 1)).ok());
  RETURN_IF_ERROR(commit(change_of(row), batch));
  scenes_.set_row(*log_state, row, row_checksum_of(key), catalogue_.totals());
  write_durable_marker(false);
  return absl::OkStatus();
}

absl::Status RocksdbLog::read_snapshot(SceneKey key, ChunkSink sink) const {
  ASSIGN_OR_RETURN(const SceneLogStatePtr log_state, scenes_.find(key));
  absl::StatusOr<SceneRow> row;
  {
    MutexLock lock(catalogue_mutex_);
    row = row_of(key);
  }
  RETURN_IF_ERROR(row.status());
  absl::Status status =
      read_chunks(*database_, database_->snapshot(), snapshot_prefix(key, row->snapshot_id), row->snapshot, sink);
  if (!absl::IsDataLoss(status)) return status;
  return absl::DataLossError(
      absl::StrCat("scene '", row->name, "' is damaged: its snapshot: ", status.message(), repair_hint(options_.path)));
}

bool RocksdbLog::in_use(absl::string_view pending) const {
  RowReader in(pending.substr(1));
  if (pending[0] == kPendingSnapshotTag) {
    const absl::StatusOr<SceneRow> row = row_of(in.big_u64());
    return row.ok() && row->snapshot_id == in.big_u64();
  }
  const absl::string_view sha256 = in.bytes(Sha256().size());
  const std::optional<absl::string_view> bytes = catalogue_.find(absl::StrCat(std::string(1, kContentTag), sha256));
  const std::optional<ContentRow> row = bytes ? decode_content(*bytes) : std::nullopt;
  const uint64_t number = in.big_u64();
  return (row && row->content_id == number) || parts_in_use(sha256, number);
}

std::optional<MeshRow> RocksdbLog::mesh_row(absl::string_view name) const {
  const std::optional<absl::string_view> bytes = catalogue_.find(mesh_key(name));
  return bytes ? decode_mesh(*bytes) : std::nullopt;
}

bool RocksdbLog::parts_in_use(absl::string_view sha256, uint64_t number) const {
  const std::string start(1, kMeshTag);
  for (auto row = catalogue_.rows().lower_bound(start); row != catalogue_.rows().end() && row->first[0] == kMeshTag;
       ++row) {
    const std::optional<MeshRow> mesh = mesh_row(absl::string_view(row->first).substr(1));
    if (mesh && mesh->parts && mesh->parts->content_id == number && encode(MeshRow{mesh->sha256, {}}) == sha256)
      return true;
  }
  return false;
}

bool RocksdbLog::content_in_use(const Sha256& sha256, absl::string_view but) const {
  const std::string start(1, kMeshTag);
  for (auto row = catalogue_.rows().lower_bound(start); row != catalogue_.rows().end() && row->first[0] == kMeshTag;
       ++row) {
    const absl::string_view name = absl::string_view(row->first).substr(1);
    const std::optional<MeshRow> mesh = mesh_row(name);
    if (name != but && mesh && mesh->sha256 == sha256) return true;
  }
  return false;
}

absl::Status RocksdbLog::add_mesh(absl::string_view name, const Sha256& sha256, ChunkSource content,
                                  ChunkSource parts) {
  MutexLock adding(adding_mesh_);
  RETURN_IF_ERROR(check_free_space("a new mesh", 0));
  std::optional<std::string> stored;  // encoded row of the content; no value if the content is not stored yet
  bool damaged = false;
  {
    MutexLock lock(catalogue_mutex_);
    const std::optional<MeshRow> there = mesh_row(name);
    if (there && there->sha256 == sha256) return absl::OkStatus();
    if (catalogue_.find(mesh_key(name))) return mesh_already_stored(name);
    if (const auto row = catalogue_.find(content_key(sha256))) stored = std::string(*row);
    damaged = damaged_contents_.contains(sha256);
  }
  CatalogueChange change;
  rocksdb::WriteBatch batch;
  std::vector<uint64_t> written;
  const auto drop = [&] {
    for (const uint64_t number : written)
      drop_chunks(database_->mesh(), pending_mesh_key(sha256, number), mesh_prefix(sha256, number));
  };
  const auto put = [&](ChunkSource source) -> absl::StatusOr<ContentRow> {
    const uint64_t number = new_content_id();
    const std::string pending = pending_mesh_key(sha256, number);
    ASSIGN_OR_RETURN(const ChunkList chunks,
                     put_chunks(database_->mesh(), pending, mesh_prefix(sha256, number), source));
    written.push_back(number);
    LOCUS_CHECK(batch.Delete(database_->meta(), pending).ok());
    return ContentRow{number, chunks};
  };
  if (!stored || damaged) {
    ASSIGN_OR_RETURN(const ContentRow row, put(content));
    change.rows.push_back({content_key(sha256), encode(row)});
    if (const std::optional<ContentRow> replaced = stored ? decode_content(*stored) : std::nullopt) {
      const std::string prefix = mesh_prefix(sha256, replaced->content_id);
      LOCUS_CHECK(batch.DeleteRange(database_->mesh(), prefix, end_of(prefix)).ok());
    }
  }
  const absl::StatusOr<ContentRow> row = put(parts);
  if (!row.ok()) {
    drop();
    return row.status();
  }
  change.rows.push_back({mesh_key(name), encode(MeshRow{sha256, *row})});
  MutexLock lock(catalogue_mutex_);
  if (absl::Status status = commit(change, batch); !status.ok()) {
    drop();
    return status;
  }
  damaged_contents_.erase(sha256);
  scenes_.set_catalogue(catalogue_.totals());
  write_durable_marker(false);
  return absl::OkStatus();
}

absl::Status RocksdbLog::delete_mesh(absl::string_view name) {
  MutexLock adding(adding_mesh_);
  MutexLock lock(catalogue_mutex_);
  if (!catalogue_.find(mesh_key(name))) return mesh_not_stored(name);
  const MeshRow mesh = mesh_row(name).value_or(MeshRow());
  CatalogueChange change{{{mesh_key(name), std::nullopt}}, 0};
  rocksdb::WriteBatch batch;
  if (!content_in_use(mesh.sha256, name)) {
    change.rows.push_back({content_key(mesh.sha256), std::nullopt});
    const std::string all = content_key(mesh.sha256).substr(1);
    LOCUS_CHECK(batch.DeleteRange(database_->mesh(), all, end_of(all)).ok());
  } else if (mesh.parts) {
    const std::string prefix = mesh_prefix(mesh.sha256, mesh.parts->content_id);
    LOCUS_CHECK(batch.DeleteRange(database_->mesh(), prefix, end_of(prefix)).ok());
  }
  RETURN_IF_ERROR(commit(change, batch));
  if (change.rows.size() > 1) topologies_.drop(mesh.sha256);
  scenes_.set_catalogue(catalogue_.totals());
  write_durable_marker(false);
  return absl::OkStatus();
}

absl::Status RocksdbLog::set_mesh_graces(absl::Span<const std::string> names, uint32_t grace_s) {
  MutexLock adding(adding_mesh_);
  MutexLock lock(catalogue_mutex_);
  CatalogueChange change;
  for (const std::string& name : names) {
    std::optional<MeshRow> row = mesh_row(name);
    if (!row) return mesh_not_stored(name);
    row->grace_s = grace_s;
    change.rows.push_back({mesh_key(name), encode(*row)});
  }
  rocksdb::WriteBatch batch;
  RETURN_IF_ERROR(commit(change, batch));
  scenes_.set_catalogue(catalogue_.totals());
  write_durable_marker(false);
  return absl::OkStatus();
}

absl::Status RocksdbLog::read_mesh(const Sha256& sha256, ChunkSink sink) const {
  std::optional<ContentRow> row;
  {
    MutexLock lock(catalogue_mutex_);
    const std::optional<absl::string_view> bytes = catalogue_.find(content_key(sha256));
    if (bytes) row = decode_content(*bytes);
  }
  if (!row) return not_stored("the log has no mesh of this content");
  absl::Status status = read_mesh_chunks(sha256, *row, sink);
  if (absl::IsDataLoss(status)) {
    MutexLock lock(catalogue_mutex_);
    damaged_contents_.insert(sha256);
  }
  return status;
}

absl::Status RocksdbLog::read_parts(absl::string_view name, ChunkSink sink) const {
  std::optional<MeshRow> row;
  {
    MutexLock lock(catalogue_mutex_);
    row = mesh_row(name);
  }
  if (!row) return mesh_not_stored(name);
  return row->parts ? read_mesh_chunks(row->sha256, *row->parts, sink) : absl::OkStatus();
}

absl::Status RocksdbLog::read_mesh_chunks(const Sha256& sha256, const ContentRow& row, ChunkSink sink) const {
  absl::Status status =
      read_chunks(*database_, database_->mesh(), mesh_prefix(sha256, row.content_id), row.chunks, sink);
  if (!absl::IsDataLoss(status)) return status;
  return absl::DataLossError(absl::StrCat("a mesh is damaged: ", status.message(), repair_hint(options_.path)));
}

void RocksdbLog::store_topology(const Sha256& sha256, absl::string_view bytes) {
  if (!check_free_space("the topology of a tree", bytes.size()).ok()) return;
  topologies_.keep(sha256, bytes);
  written_bytes_ += bytes.size();
}

uint64_t RocksdbLog::cache_bytes() const { return database_->buffered_bytes() + database_->block_cache_bytes(); }

std::optional<std::string> RocksdbLog::read_topology(const Sha256& sha256) const { return topologies_.read(sha256); }

}  // namespace locus::server
