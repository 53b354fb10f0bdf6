#include "server/storage/rocksdb_log.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "rocksdb/utilities/checkpoint.h"
#include "server/storage/rocksdb/errors.h"
#include "server/storage/rocksdb/reading.h"
#include "server/storage/rows/refusals.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {
namespace {

constexpr auto kPollInterval = std::chrono::milliseconds(100);
constexpr uint64_t kBatchOverhead = 128;  // bytes reserved for each record of a write batch, in addition to its payload
constexpr uint64_t kBytesBetweenPolls = uint64_t{8} << 20;  // maximum bytes written between two polls of free space

absl::Status too_large(uint64_t bytes) {
  return refuse_limit("entries", "record_bytes", static_cast<double>(UpdateLog::kMaxRecordBytes),
                      static_cast<double>(bytes));
}

}  // namespace

absl::StatusOr<std::unique_ptr<RocksdbLog>> RocksdbLog::open(const StorageOptions& options) {
  const StorageOptions resolved = with_defaults(options);
  ASSIGN_OR_RETURN(OpenedDirectory opened, open_directory(resolved));
  std::unique_ptr<RocksdbLog> log(new RocksdbLog(resolved, std::move(opened)));
  RETURN_IF_ERROR(log->finish_opening());
  return log;
}

RocksdbLog::RocksdbLog(const StorageOptions& options, OpenedDirectory opened)
    : options_(options),
      lock_(std::move(opened.lock)),
      database_(std::move(opened.database)),
      damage_report_(std::move(opened.damage_report)),
      closed_in_order_(opened.durable_marker.closed),
      topologies_(*options.env, options.path),
      durable_marker_file_(std::move(opened.durable_marker_file)),
      durable_marker_(std::move(opened.durable_marker)) {}

RocksdbLog::~RocksdbLog() {
  if (!background_thread_.joinable()) return;  // opening failed: there is nothing to close
  {
    MutexLock lock(background_mutex_);
    ended_ = true;
    background_wakeup_.notify_all();
  }
  background_thread_.join();
  const auto written = scenes_.written();
  const bool in_order = database_->sync().ok();
  if (in_order) scenes_.mark_synced(written);
  write_durable_marker(in_order);
}

void RocksdbLog::list_stored() {
  for (const SceneHealth& found : damage_report_.scenes) {
    StoredScene& stored = stored_scenes_.emplace_back();
    auto log_state = std::make_shared<SceneLogState>();
    log_state->key = stored.key = found.key;
    log_state->name = stored.name = found.name;
    stored.last_sequence = found.last;
    stored.log_bytes = found.log_bytes;
    if (found.row) {
      stored.spec = found.row->spec;
      log_state->epoch = stored.epoch = found.row->epoch;
      stored.snapshot_sequence = found.row->snapshot_sequence;
    }
    if (!found.damage.empty()) {
      stored.damage = absl::DataLossError(
          absl::StrCat("scene '", found.name, "' is damaged: ", found.damage, repair_hint(options_.path)));
      log_state->damage = stored.damage;
      log_state->damage_found = found.damage;
    }
    log_state->row_checksum = found.row_checksum;
    log_state->copied = stored.copied = found.copied;
    log_state->written = {found.last, found.running_checksum};
    log_state->synced = log_state->written;  // open_directory() synced the log before reading it
    // If the last records are missing, continue with the sequence number that the durable marker contains, so that the
    // next marker does not contain a lower one, which would hide the loss.
    if (found.last < found.expected_sequence)
      log_state->synced.sequence = log_state->written.sequence = found.expected_sequence;
    scenes_.add(std::move(log_state));
  }
  std::sort(stored_scenes_.begin(), stored_scenes_.end(),
            [](const StoredScene& a, const StoredScene& b) { return a.name < b.name; });
  if (!damage_report_.catalogue_damage.empty())
    catalogue_damage_ = absl::DataLossError(
        absl::StrCat(options_.path, " is damaged: ", damage_report_.catalogue_damage, repair_hint(options_.path)));
  for (const MeshHealth& found : damage_report_.meshes) {
    StoredMesh& stored = stored_meshes_.emplace_back();
    stored.name = found.name;
    stored.sha256 = found.sha256;
    stored.grace_s = found.grace_s;
    stored.parts_in_content = !found.parts.has_value();
    if (!found.damage.empty())
      stored.damage = absl::DataLossError(
          absl::StrCat("mesh '", found.name, "' is damaged: ", found.damage, repair_hint(options_.path)));
  }
}

absl::Status RocksdbLog::finish_opening() {
  list_stored();
  {
    MutexLock lock(catalogue_mutex_);
    MutexLock marker_lock(marker_mutex_);
    const CatalogueRow stored = damage_report_.catalogue.value_or(CatalogueRow());
    catalogue_ = Catalogue(std::move(damage_report_.rows), std::max(stored.generation, durable_marker_.catalogue),
                           std::max(stored.next_scene, durable_marker_.next_scene));
    next_scene_ = catalogue_.totals().next_scene;
    rocksdb::WriteBatch batch;
    for (const std::string& key : damage_report_.pending) {
      if (!in_use(key)) {
        rocksdb::ColumnFamilyHandle* family = key[0] == kPendingMeshTag ? database_->mesh() : database_->snapshot();
        LOCUS_CHECK(batch.DeleteRange(family, key.substr(1), end_of(key.substr(1))).ok());
      }
      if (key[0] == kPendingSnapshotTag)
        next_scene_ = std::max(next_scene_, RowReader(absl::string_view(key).substr(1)).big_u64() + 1);
      LOCUS_CHECK(batch.Delete(database_->meta(), key).ok());
    }
    // Store the new format number: older versions of locusd must no longer open the directory, because they cannot read
    // rows that this version writes.
    if (damage_report_.format < kFormat)
      LOCUS_CHECK(
          batch.Put(database_->meta(), slice_of(kFormatKey), with_checksum(kFormatKey, RowWriter().u32(kFormat).view()))
              .ok());
    const bool consistent = stored.generation == catalogue_.totals().generation &&
                            stored.scene_sum == catalogue_.totals().scene_sum &&
                            stored.mesh_sum == catalogue_.totals().mesh_sum;
    if (!consistent || batch.Count() > 0) {
      RETURN_IF_ERROR(commit(CatalogueChange(), batch));
    }
    scenes_.set_catalogue(catalogue_.totals());
    topologies_.drop_unused(content_hashes());
  }
  damage_report_ = DamageReport();
  poll_free_space();
  write_durable_marker(false);
  if (marker_failed_)
    return absl::UnavailableError(absl::StrCat("writing ", options_.path, "/", DurableMarkerFile::kName));
  background_thread_ = std::thread([this] { run_background(); });
  return absl::OkStatus();
}

std::set<Sha256> RocksdbLog::content_hashes() const {
  std::set<Sha256> contents;
  const std::string start(1, kContentTag);
  for (auto row = catalogue_.rows().lower_bound(start); row != catalogue_.rows().end(); ++row) {
    Sha256 sha256 = {};
    if (row->first[0] != kContentTag || row->first.size() != 1 + sha256.size()) break;
    std::copy_n(row->first.begin() + 1, sha256.size(), sha256.begin());
    contents.insert(sha256);
  }
  return contents;
}

absl::StatusOr<uint64_t> RocksdbLog::append(SceneKey key, absl::Span<const LogEntry> entries, AckLevel level) {
  ASSIGN_OR_RETURN(const SceneLogStatePtr log_state, scenes_.find(key));
  SceneLogState& scene = *log_state;
  if (entries.empty()) return scenes_.last_of(scene);
  uint64_t bytes = 0;
  for (const LogEntry& entry : entries) bytes += entry.bytes.size();
  if (bytes > kMaxRecordBytes) return too_large(bytes);
  RETURN_IF_ERROR(check_free_space("appending", bytes));

  MutexLock lock(scene.writing);
  ASSIGN_OR_RETURN(const auto start,
                   scenes_.begin_append(scene, entries.front().epoch, database_->db().GetLatestSequenceNumber()));
  rocksdb::WriteBatch batch(bytes + entries.size() * kBatchOverhead);
  Position at = start.written;
  for (const LogEntry& entry : entries) {
    LOCUS_CHECK_EQ(entry.epoch, entries.front().epoch);
    const std::string record_key = log_key(key, ++at.sequence);
    const std::string head = record_head(entry);
    at.running_checksum = record_checksum(record_key, head, entry.bytes, at.running_checksum);
    const std::string checksum_bytes = RowWriter().u64(at.running_checksum).take();
    const rocksdb::Slice key_part(record_key);
    const rocksdb::Slice parts[] = {head, slice_of(entry.bytes), checksum_bytes};
    LOCUS_CHECK(batch.Put(database_->log(), rocksdb::SliceParts(&key_part, 1), rocksdb::SliceParts(parts, 3)).ok());
  }
  for (uint64_t possibly_written = at.sequence + 1; possibly_written <= start.possibly_written_end; ++possibly_written)
    LOCUS_CHECK(batch.Delete(database_->log(), log_key(key, possibly_written)).ok());
  LOCUS_DCHECK_EQ(at.sequence, start.written.sequence + entries.size());
  const bool synced = level == AckLevel::kLocal;
  if (absl::Status status = database_->write(batch, synced && options_.sync); !status.ok()) {
    scenes_.fail_append(scene, at.sequence);
    return status;
  }
  written_bytes_ += bytes;
  scenes_.end_append(scene, at, synced);
  wake_background(synced);
  return at.sequence;
}

absl::Status RocksdbLog::read(SceneKey key, uint64_t from, RecordSink sink) const {
  ASSIGN_OR_RETURN(const SceneLogStatePtr log_state, scenes_.find(key));
  const uint64_t last = scenes_.last_of(*log_state);
  SceneRow row;
  {
    MutexLock lock(catalogue_mutex_);
    ASSIGN_OR_RETURN(SceneRow found, row_of(key));
    row = std::move(found);
  }
  if (from <= row.snapshot_sequence) return refuse_read_before(row.snapshot_sequence);
  if (from > last) return absl::OkStatus();
  ASSIGN_OR_RETURN(const uint64_t running_checksum, running_checksum_at(row, from - 1));
  absl::Status status = read_records(*database_, key, from, last, running_checksum, sink);
  if (!absl::IsDataLoss(status)) return status;
  return absl::DataLossError(
      absl::StrCat("scene '", row.name, "' is damaged: ", status.message(), repair_hint(options_.path)));
}

absl::StatusOr<uint64_t> RocksdbLog::running_checksum_at(const SceneRow& row, uint64_t sequence) const {
  if (sequence == row.snapshot_sequence) return row.running_checksum;
  rocksdb::PinnableSlice value;
  const rocksdb::Status status =
      database_->db().Get(reading_options(), database_->log(), log_key(row.key, sequence), &value);
  if (status.ok() && value.size() >= kRecordOverhead) return stored_checksum(view_of(value));
  if (status.ok() || status.IsNotFound())
    return absl::DataLossError(absl::StrCat("scene '", row.name, "' is damaged: record ", sequence, " is missing",
                                            repair_hint(options_.path)));
  return read_error(absl::StrCat("reading record ", sequence, " of scene '", row.name, "'"), status);
}

absl::StatusOr<uint64_t> RocksdbLog::latest(SceneKey key) const {
  ASSIGN_OR_RETURN(const SceneLogStatePtr log_state, scenes_.find(key));
  return scenes_.last_of(*log_state);
}

absl::Status RocksdbLog::back_up(const std::string& path) {
  rocksdb::Env& env = *options_.env;
  const std::string unfinished = path + ".unfinished";
  if (env.FileExists(path).ok() || env.FileExists(unfinished).ok())
    return refuse_argument(Reason::kAlreadyExists, "path", std::nullopt,
                           absl::StrCat(path, " or ", unfinished, " exists already: name a new directory"));
  MutexLock lock(catalogue_mutex_);
  DurableMarker durable_marker;
  {
    // Fill the marker before making the copy, so that the marker names only data that the copy contains. Sync before
    // filling the marker, because a marker names only synced records.
    const auto written = scenes_.written();
    RETURN_IF_ERROR(database_->sync());
    scenes_.mark_synced(written);
    scenes_.fill_marker(0, durable_marker);
    // Mark the scenes as copied, so that they get a new epoch when the copy is opened. The original scenes continue in
    // this directory with the old epoch, so the two sequences of revisions will differ.
    for (SceneMarker& scene_marker : durable_marker.scene_markers) scene_marker.copied = true;
  }
  {
    MutexLock marker_lock(marker_mutex_);
    durable_marker.catalogue_damage = durable_marker_.catalogue_damage;
  }
  rocksdb::Status status = env.CreateDir(unfinished);
  rocksdb::Checkpoint* made = nullptr;
  if (status.ok()) status = rocksdb::Checkpoint::Create(&database_->db(), &made);
  const std::unique_ptr<rocksdb::Checkpoint> checkpoint(made);
  if (status.ok()) status = checkpoint->CreateCheckpoint(absl::StrCat(unfinished, "/", kDatabaseFolder));
  if (!status.ok()) return disk_error(absl::StrCat("backing up to ", path), status);
  RETURN_IF_ERROR(DurableMarkerFile(env, unfinished).replace(durable_marker));
  status = env.RenameFile(unfinished, path);
  if (status.ok()) status = sync_folder(env, path);
  return status.ok() ? absl::OkStatus() : disk_error(absl::StrCat("backing up to ", path), status);
}

absl::Status RocksdbLog::check_free_space(absl::string_view what, uint64_t bytes) {
  if (written_bytes_ + bytes > kBytesBetweenPolls) poll_free_space();
  const uint64_t polled = free_bytes_;
  const uint64_t free = polled - std::min<uint64_t>(polled, written_bytes_);
  if (free < *options_.reserve_bytes || free - *options_.reserve_bytes < bytes)
    return refuse_full_disk(what, bytes, *options_.reserve_bytes, free);
  if (marker_failed_)
    return absl::UnavailableError(
        absl::StrCat(options_.path, "/", DurableMarkerFile::kName,
                     " cannot be written; the log accepts records again once it can be written"));
  return absl::OkStatus();
}

void RocksdbLog::poll_free_space() {
  uint64_t free = 0;
  written_bytes_ = 0;
  free_bytes_ = options_.env->GetFreeSpace(options_.path, &free).ok() ? free : ~uint64_t{0};
}

void RocksdbLog::write_durable_marker(bool closed) {
  MutexLock lock(marker_mutex_);
  scenes_.fill_marker(database_->db().GetLatestSequenceNumber(), durable_marker_);
  describe_file_list(*database_, durable_marker_);
  durable_marker_.closed = closed;
  marker_failed_ = !durable_marker_file_->write(durable_marker_).ok();
}

void RocksdbLog::wake_background(bool synced) {
  MutexLock lock(background_mutex_);
  const SteadyTime now = std::chrono::steady_clock::now();
  bool earlier = false;
  if (synced && !marker_due_) {
    marker_due_ = now + options_.durable_marker_delay;
    earlier = true;
  }
  if (!synced && !sync_due_) {
    sync_due_ = now + options_.memory_sync_delay;
    earlier = true;
  }
  if (earlier) background_wakeup_.notify_one();
}

void RocksdbLog::run_background() {
  SteadyTime poll_at = std::chrono::steady_clock::now();
  while (true) {
    bool marker = false;
    bool sync = false;
    {
      MutexLock lock(background_mutex_);
      SteadyTime until = poll_at;
      if (marker_due_) until = std::min(until, *marker_due_);
      if (sync_due_) until = std::min(until, *sync_due_);
      if (!ended_) background_wakeup_.wait_until(background_mutex_, until);
      if (ended_) return;
      const SteadyTime now = std::chrono::steady_clock::now();
      marker = marker_due_ && *marker_due_ <= now;
      sync = sync_due_ && *sync_due_ <= now;
      if (marker) marker_due_.reset();
      if (sync) sync_due_.reset();
    }
    if (sync) {
      const auto written = scenes_.written();
      if (database_->sync().ok()) scenes_.mark_synced(written);
      marker = true;
    }
    if (marker || marker_failed_) write_durable_marker(false);
    if (const SteadyTime now = std::chrono::steady_clock::now(); poll_at <= now) {
      poll_at = now + kPollInterval;
      poll_disk();
    }
  }
}

void RocksdbLog::poll_disk() {
  poll_free_space();
  if (!database_->needs_recovery()) return;
  const auto written = scenes_.written();
  if (!database_->recover(free_bytes_).ok()) return;  // writes fail until a later poll succeeds
  scenes_.mark_synced(written);
  write_durable_marker(false);
}

}  // namespace locus::server
