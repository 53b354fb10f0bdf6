#include "core/scene/log/scene_journal.h"

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/scratch.h"
#include "core/scene/log/record_codec.h"

namespace locus {
namespace {

constexpr uint32_t kFencedRetryMs = 50;

// The largest batch and the largest static change fit into a record. The values of one item take at most 128 bytes in
// all columns together, and the column lengths of one list take at most 256 bytes. One instance takes at most 320
// bytes, including the hash, the name and the bounds of its mesh.
static_assert(uint64_t{limits::kMaxUpdateItems} * 128 + uint64_t{limits::kMaxUpdateLists} * 256 <=
              UpdateLog::kMaxRecordBytes);
static_assert(uint64_t{limits::kMaxInstances} * 320 <= UpdateLog::kMaxRecordBytes);

// Returns the error for the caller of a change: another server leads the scene if the log is fenced.
absl::Status for_caller(absl::Status status) {
  if (!absl::IsAborted(status)) return status;
  return no_leader("another server has become the leader of the scene, and nothing was changed", kFencedRetryMs);
}

}  // namespace

void SceneJournal::check_invariants() const {
  LOCUS_CHECK_LE(position_.snapshot_sequence, position_.sequence);
  LOCUS_CHECK(position_.bytes == 0 || position_.sequence > position_.snapshot_sequence);
}

void SceneJournal::begin(const SceneLog& log) {
  LOCUS_CHECK(!on() && log.log != nullptr);
  log_ = log;
  key_ = log.key;
  const MutexLock lock(mutex_);
  position_ = log.position;
  LOCUS_DCHECK_CALL(check_invariants());
}

void SceneJournal::end_record(uint64_t epoch, const UpdateBatch& batch) {
  entries_.push_back({epoch, batch.writer, batch.batch, {}});
  ends_.push_back(bytes_.size());
}

absl::Status SceneJournal::append_each(uint64_t epoch, absl::Span<const UpdateBatch* const> batches) {
  if (!on() || batches.empty()) return absl::OkStatus();
  for (const UpdateBatch* batch : batches) {
    LOCUS_DCHECK(check_form(*batch).ok());
    encode_batch(*batch, bytes_);
    end_record(epoch, *batch);
  }
  return append(log_.level);
}

absl::Status SceneJournal::append_joined(uint64_t epoch, absl::Span<const UpdateBatch* const> batches) {
  if (!on() || batches.empty()) return absl::OkStatus();
  for (const UpdateBatch* batch : batches) LOCUS_DCHECK(check_form(*batch).ok() && may_join(*batches.front(), *batch));
  encode_joined(batches, bytes_);
  end_record(epoch, *batches.back());
  return append(log_.level);
}

absl::Status SceneJournal::append_change(uint64_t epoch, const StaticChange& change, absl::Span<const Id> placed) {
  if (!on()) return absl::OkStatus();
  encode_change(change, placed, bytes_);
  end_record(epoch, UpdateBatch());
  return append(AckLevel::kLocal);
}

absl::Status SceneJournal::append(AckLevel level) {
  LOCUS_DCHECK_EQ(entries_.size(), ends_.size());
  LOCUS_DCHECK(!ends_.empty() && ends_.back() == bytes_.size());
  absl::Status status;
  size_t begin = 0;
  for (size_t i = 0; i < entries_.size(); ++i) {
    LOCUS_DCHECK_LT(begin, ends_[i]);
    entries_[i].bytes = absl::string_view(bytes_).substr(begin, ends_[i] - begin);
    begin = ends_[i];
    if (entries_[i].bytes.size() > UpdateLog::kMaxRecordBytes)
      status = refuse_limit("batch", "record_bytes", static_cast<double>(UpdateLog::kMaxRecordBytes),
                            static_cast<double>(entries_[i].bytes.size()));
  }
  if (status.ok()) {
    const absl::StatusOr<uint64_t> last = log_.log->append(log_.key, entries_, level);
    status = for_caller(last.status());
    if (status.ok()) {
      const MutexLock lock(mutex_);
      position_.sequence += entries_.size();
      position_.bytes += bytes_.size();
      // A different sequence number would mean that the log belongs to another scene.
      LOCUS_CHECK_EQ(*last, position_.sequence);
      LOCUS_DCHECK_CALL(check_invariants());
    }
  }
  entries_.clear();
  ends_.clear();
  bytes_.clear();
  if (bytes_.capacity() > kKeptScratch) std::string().swap(bytes_);
  return status;
}

absl::Status SceneJournal::set_spec(absl::string_view spec) {
  return on() ? for_caller(log_.log->set_scene_spec(log_.key, spec)) : absl::OkStatus();
}

absl::Status SceneJournal::remove() { return on() ? for_caller(log_.log->delete_scene(log_.key)) : absl::OkStatus(); }

LogPosition SceneJournal::position() const {
  const MutexLock lock(mutex_);
  return position_;
}

uint64_t SceneJournal::total_bytes() const {
  const MutexLock lock(mutex_);
  return bytes_in_snapshots_ + position_.bytes;
}

void SceneJournal::snapshot_written(uint64_t sequence, uint64_t total_bytes) {
  const MutexLock lock(mutex_);
  if (sequence < position_.snapshot_sequence) return;  // a later snapshot was written meanwhile
  LOCUS_CHECK_LE(sequence, position_.sequence);
  const uint64_t logged = bytes_in_snapshots_ + position_.bytes;
  LOCUS_CHECK_LE(total_bytes, logged);
  position_.snapshot_sequence = sequence;
  position_.bytes = logged - total_bytes;
  bytes_in_snapshots_ = total_bytes;
  LOCUS_DCHECK_CALL(check_invariants());
}

}  // namespace locus
