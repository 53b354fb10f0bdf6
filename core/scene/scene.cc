#include "core/scene/scene.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"

namespace locus {
namespace {

absl::Status restarted(uint64_t now, uint64_t asked) {
  Refusal refusal;
  refusal.reason = Reason::kSceneRestarted;
  refusal.field = "view.epoch";
  return refuse(absl::StatusCode::kFailedPrecondition,
                absl::StrCat("the scene's epoch is ", now, ", not ", asked,
                             ": it was made anew; forget what you knew of its revisions and ask for the latest"),
                refusal);
}

absl::Status outside_recent(uint64_t oldest, uint64_t newest, uint64_t asked) {
  Refusal refusal;
  refusal.reason = Reason::kOutOfRange;
  refusal.field = "view.exactly";
  refusal.limit = "recent_revisions";
  refusal.limit_value = limits::kRecentRevisions;
  refusal.asked = static_cast<double>(asked);
  return refuse(absl::StatusCode::kOutOfRange,
                absl::StrCat("revision ", asked, " is not held; revisions ", oldest, " to ", newest, " are"), refusal);
}

absl::Status too_late(uint64_t newest, uint64_t asked) {
  Refusal refusal;
  refusal.reason = Reason::kOutOfRange;
  refusal.field = "view.at_least";
  refusal.asked = static_cast<double>(asked);
  return refuse(absl::StatusCode::kDeadlineExceeded,
                absl::StrCat("revision ", asked, " was not reached in time; the scene is at ", newest), refusal);
}

// The placement that asked for the id at `position` of all placed ones.
absl::Status taken_meanwhile(const StaticChange& change, size_t position, Id id) {
  size_t list = 0;
  while (position >= change.place[list].count()) position -= change.place[list++].count();
  return refuse_argument(Reason::kDuplicateId, absl::StrCat("place[", list, "].ids"), static_cast<uint32_t>(position),
                         absl::StrCat("the id ", id, " was taken by an object meanwhile"));
}

}  // namespace

Scene::Scene(std::string name, SceneSpec spec, uint64_t epoch, std::shared_ptr<const StaticSet> statics)
    : name_(std::move(name)),
      spec_(std::move(spec)),
      writer_(epoch, spec_.winding, std::move(statics), limits::kMaxObjects, spec_.history) {
  LOCUS_CHECK_NE(epoch, uint64_t{0});
  latest_ = writer_.published();
  recent_.push_back({latest_, 0});
}

absl::Status Scene::closed_status() const {
  Refusal refusal;
  refusal.reason = Reason::kNotFound;
  refusal.field = "scene";
  return refuse(absl::StatusCode::kNotFound, absl::StrCat("scene ", name_, " was deleted"), refusal);
}

absl::Status Scene::check_open() const {
  const MutexLock lock(mutex_);
  return closed_ ? closed_status() : absl::OkStatus();
}

absl::StatusOr<UpdateAck> Scene::apply(const UpdateBatch& batch) {
  if (absl::Status status = check_form(batch); !status.ok()) return status;
  const MutexLock lock(writer_mutex_);
  if (absl::Status status = check_open(); !status.ok()) return status;
  absl::StatusOr<SceneWriter::Applied> applied = writer_.apply(batch);
  if (!applied.ok()) return applied.status();
  if (applied->snapshot != nullptr) publish(std::move(applied->snapshot), applied->replaced_bytes);
  return std::move(applied->ack);
}

absl::Status Scene::admit_change() {
  const MutexLock lock(mutex_);
  if (closed_) return closed_status();
  if (pending_changes_ >= limits::kMaxPendingChanges)
    return refuse_full("scene", "pending_changes", limits::kMaxPendingChanges, pending_changes_ + 1.0, 100);
  ++pending_changes_;
  return absl::OkStatus();
}

absl::StatusOr<InstanceChange> Scene::change_instances(const StaticChange& change) {
  if (absl::Status status = admit_change(); !status.ok()) return status;
  absl::StatusOr<InstanceChange> result;
  {
    const MutexLock change_lock(change_mutex_);
    result = build_and_publish(change);
  }
  const MutexLock lock(mutex_);
  --pending_changes_;
  if (!result.ok()) last_build_error_ = std::string(result.status().message());
  return result;
}

absl::StatusOr<InstanceChange> Scene::build_and_publish(const StaticChange& change) {
  const SnapshotPtr base = latest();
  const auto is_object = [&base](Id id) { return static_cast<bool>(base->objects.find_ref(id)); };
  absl::StatusOr<StaticSet::Changed> changed = base->statics->apply(change, is_object, base->revision << 24);
  if (!changed.ok()) return changed.status();
  const MutexLock lock(writer_mutex_);
  if (absl::Status status = check_open(); !status.ok()) return status;
  // Objects inserted while the tree was being built may have taken an id.
  for (size_t i = 0; i < changed->placed.size(); ++i)
    if (writer_.is_object(changed->placed[i])) return taken_meanwhile(change, i, changed->placed[i]);
  SnapshotPtr snapshot = writer_.replace_statics(std::move(changed->set));
  InstanceChange result{std::move(changed->placed), snapshot->revision, snapshot->epoch};
  publish(std::move(snapshot), 0);
  return result;
}

void Scene::publish(SnapshotPtr snapshot, uint64_t replaced_bytes) {
  std::vector<Recent> retired;  // freed after the lock: freeing a large snapshot takes a while
  const MutexLock lock(mutex_);
  latest_ = std::move(snapshot);
  recent_.push_back({latest_, replaced_bytes});
  recent_bytes_ += replaced_bytes;
  while (recent_.size() > 1 && (recent_.size() > limits::kRecentRevisions || recent_bytes_ > limits::kRecentBytes)) {
    // What the oldest held alone is what the next one replaced.
    retired.push_back(std::move(recent_.front()));
    recent_.pop_front();
    recent_bytes_ -= recent_.front().replaced_bytes;
    recent_.front().replaced_bytes = 0;
  }
  published_.notify_all();
}

SnapshotPtr Scene::latest() const {
  const MutexLock lock(mutex_);
  return latest_;
}

absl::StatusOr<SnapshotPtr> Scene::recent(uint64_t revision) const {
  const uint64_t oldest = recent_.front().snapshot->revision;
  if (revision < oldest || revision > latest_->revision) return outside_recent(oldest, latest_->revision, revision);
  return recent_[revision - oldest].snapshot;
}

absl::StatusOr<SnapshotPtr> Scene::view(const View& view, std::chrono::steady_clock::time_point deadline) const {
  const MutexLock lock(mutex_);
  if (closed_) return closed_status();
  if (view.epoch != 0 && view.epoch != latest_->epoch) return restarted(latest_->epoch, view.epoch);
  if (view.kind == View::Kind::kExactly) return recent(view.revision);
  if (view.kind == View::Kind::kLatest) return latest_;
  while (latest_->revision < view.revision) {
    const bool in_time = published_.wait_until(mutex_, deadline);
    if (closed_) return closed_status();
    if (!in_time && latest_->revision < view.revision) return too_late(latest_->revision, view.revision);
  }
  return latest_;
}

void Scene::forget_recent() {
  std::deque<Recent> forgotten;  // freed after the lock, as in publish()
  const MutexLock lock(mutex_);
  forgotten.swap(recent_);
  recent_.push_back({latest_, 0});
  recent_bytes_ = 0;
}

void Scene::close() {
  const MutexLock lock(mutex_);
  closed_ = true;
  published_.notify_all();
}

SceneStatus Scene::status() const {
  SceneStatus status;
  SnapshotPtr snapshot;
  {
    const MutexLock lock(mutex_);
    status.pending_changes = pending_changes_;
    status.last_build_error = last_build_error_;
    snapshot = latest_;
  }
  status.memory_bytes = snapshot->statics->bytes() + snapshot->objects.bytes();
  if (snapshot->history != nullptr) {
    status.history_bytes = snapshot->history->bytes;
    status.recorded_ticks = static_cast<uint32_t>(snapshot->history->records.size());
  }
  return status;
}

}  // namespace locus
