#include "core/scene/scene.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"

namespace locus {
namespace {

// Maximum number of times that a static change is built while update batches may be applied. If batches change the
// groups that it removes during each of these builds, it is built once more while they wait.
constexpr int kMaxBuilds = 3;

absl::Status restarted(uint64_t now, uint64_t asked) {
  Refusal refusal;
  refusal.reason = Reason::kSceneRestarted;
  refusal.field = "view.epoch";
  return refuse(absl::StatusCode::kFailedPrecondition,
                absl::StrCat("the scene's epoch is ", now, ", not ", asked,
                             ": it was created again or lost updates; drop its old revisions and query the latest"),
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
                absl::StrCat("revision ", asked, " is not retained; revisions ", oldest, " to ", newest, " are"),
                refusal);
}

absl::Status too_late(uint64_t newest, uint64_t asked) {
  Refusal refusal;
  refusal.reason = Reason::kOutOfRange;
  refusal.field = "view.at_least";
  refusal.asked = static_cast<double>(asked);
  return refuse(absl::StatusCode::kDeadlineExceeded,
                absl::StrCat("revision ", asked, " was not reached in time; the scene is at ", newest), refusal);
}

absl::Status readers_too_slow(uint64_t budget) {
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.limit = "pinned_bytes";
  refusal.limit_value = static_cast<double>(budget);
  return refuse(
      absl::StatusCode::kDeadlineExceeded,
      absl::StrCat("limit pinned_bytes is ", budget, "; readers that hold more were cancelled but have not ended; ",
                   "nothing was applied, so send the batch again"),
      refusal);
}

// Returns the error that refuses a change because an object took the id `id` while the change was being built.
// `position` is the index of the id among all placed ids of the change; the error names the placement that contains
// this index.
absl::Status taken_meanwhile(const StaticChange& change, size_t position, Id id) {
  size_t list = 0;
  while (position >= change.place[list].count()) position -= change.place[list++].count();
  return refuse_argument(Reason::kDuplicateId, absl::StrCat("place[", list, "].ids"), static_cast<uint32_t>(position),
                         absl::StrCat("the id ", id, " was taken by an object meanwhile"));
}

absl::Status mesh_is_gone(const StaticChange& change, size_t list) {
  Refusal refusal;
  refusal.reason = Reason::kNotFound;
  refusal.field = absl::StrCat("place[", list, "].mesh");
  return refuse(absl::StatusCode::kNotFound,
                absl::StrCat("mesh ", change.place[list].mesh->name(), " was deleted meanwhile; upload it again"),
                refusal);
}

// Returns the batches that pass check_form(), and appends an entry for each batch to `acks`: the error of check_form(),
// or an empty ack.
std::vector<const UpdateBatch*> well_formed(absl::Span<const UpdateBatch* const> batches, Scene::Acks& acks) {
  std::vector<const UpdateBatch*> good;
  good.reserve(batches.size());
  acks.reserve(batches.size());
  for (const UpdateBatch* batch : batches) {
    absl::Status form = check_form(*batch);
    if (form.ok()) good.push_back(batch);
    acks.push_back(form.ok() ? absl::StatusOr<UpdateAck>(UpdateAck()) : std::move(form));
  }
  return good;
}

}  // namespace

Scene::Scene(std::string name, const SceneSpec& spec, uint64_t epoch, std::shared_ptr<const StaticSet> statics)
    : Scene(std::move(name), spec,
            SceneWriter(epoch, spec.winding, std::move(statics), limits::kMaxObjects, spec.history), SceneLog()) {}

Scene::Scene(std::string name, SceneSpec spec, SceneWriter writer, const SceneLog& log)
    : name_(std::move(name)),
      spec_(std::move(spec)),
      writer_(std::move(writer)),
      journal_(log),
      settings_{spec_.labels, spec_.cell_size},
      pins_(std::make_shared<ReaderTracker>(spec_.pinned_bytes)) {
  LOCUS_CHECK_NE(writer_.epoch(), uint64_t{0});
  if (spec_.cell_size != 0) writer_.fix_cell_size(spec_.cell_size);
  latest_ = writer_.published();  // NOLINT(cppcoreguidelines-prefer-member-initializer): writer_ must have an epoch
  recent_.push_back(latest_);
  leases_ = std::make_shared<const std::vector<Lease>>(writer_.leases());
  lease_changes_ = writer_.lease_changes();
  // NOLINTNEXTLINE(cppcoreguidelines-prefer-member-initializer): needs latest_
  next_chosen_id_ = std::max(latest_->statics->first_id_above(), kFirstChosenId + latest_->revision);
}

absl::Status Scene::closed_status() const {
  RETURN_IF_ERROR(close_reason_);
  Refusal refusal;
  refusal.reason = Reason::kNotFound;
  refusal.field = "scene";
  return refuse(absl::StatusCode::kNotFound, absl::StrCat("scene ", name_, " was deleted"), refusal);
}

absl::Status Scene::check_open() const {
  const MutexLock lock(mutex_);
  return closed_ ? closed_status() : absl::OkStatus();
}

absl::Status Scene::wait_for_readers(Deadline until) const {
  return pins_->wait_until_returned(until) ? absl::OkStatus() : readers_too_slow(pins_->budget());
}

absl::StatusOr<UpdateAck> Scene::apply(const UpdateBatch& batch, Deadline until) {
  const UpdateBatch* const batches = &batch;
  ASSIGN_OR_RETURN(Acks acks, apply_each({&batches, 1}, until));
  return std::move(acks.front());
}

absl::StatusOr<Scene::Acks> Scene::apply_each(absl::Span<const UpdateBatch* const> batches, Deadline until) {
  Acks acks;
  const std::vector<const UpdateBatch*> good = well_formed(batches, acks);
  if (good.empty()) return acks;
  while (true) {
    // Wait without the writer's lock, so that each waiting caller can return at its own deadline.
    RETURN_IF_ERROR(wait_for_readers(until));
    const MutexLock lock(writer_mutex_);
    RETURN_IF_ERROR(check_open());
    if (pins_->over_budget()) continue;  // over budget again: another batch was applied after the wait
    absl::Span<const UpdateBatch* const> rest = good;
    bool logged = false;
    for (absl::StatusOr<UpdateAck>& ack : acks) {
      if (!ack.ok()) continue;
      absl::StatusOr<SceneWriter::Admission> admission = writer_.admit(*rest.front());
      // Log the first new batch and all batches after it. A later batch of the same writer may become new only when an
      // earlier batch is applied. The batches before the first new batch are duplicates or refused, so they change
      // nothing and are not logged. Logged batches must be applied, so there is no error return after the append.
      if (!logged && admission.ok() && !*admission) {
        RETURN_IF_ERROR(journal_.append_each(writer_.epoch(), rest));
        logged = true;
      }
      ack = answer(*rest.front(), std::move(admission));
      rest.remove_prefix(1);
    }
    return acks;
  }
}

absl::StatusOr<UpdateAck> Scene::answer(const UpdateBatch& batch, absl::StatusOr<SceneWriter::Admission> admission) {
  RETURN_IF_ERROR(admission.status());
  if (*admission) return **std::move(admission);
  ASSIGN_OR_RETURN(SceneWriter::Applied applied, writer_.apply_new(batch));
  publish_leases();
  if (applied.snapshot != nullptr) publish(applied.snapshot);
  return std::move(applied.ack);
}

void Scene::publish_leases() {
  if (lease_changes_ == writer_.lease_changes()) return;
  lease_changes_ = writer_.lease_changes();
  LeaseList leases = std::make_shared<const std::vector<Lease>>(writer_.leases());
  const MutexLock lock(mutex_);
  leases_ = std::move(leases);
}

Scene::LeaseList Scene::leases() const {
  const MutexLock lock(mutex_);
  return leases_;
}

absl::StatusOr<std::optional<uint64_t>> Scene::end_lease(uint64_t writer, absl::FunctionRef<bool()> is_due,
                                                         Deadline until) {
  UpdateBatch end;
  end.end_lease = writer;
  const UpdateBatch* const batches = &end;
  while (true) {
    RETURN_IF_ERROR(wait_for_readers(until));
    const MutexLock lock(writer_mutex_);
    RETURN_IF_ERROR(check_open());
    if (pins_->over_budget()) continue;
    if (!writer_.has_lease(writer) || !is_due()) return std::optional<uint64_t>();
    RETURN_IF_ERROR(journal_.append_each(writer_.epoch(), {&batches, 1}));
    const uint64_t before = latest()->objects.size();
    RETURN_IF_ERROR(answer(end, SceneWriter::Admission()).status());
    return before - latest()->objects.size();
  }
}

absl::StatusOr<Scene::Acks> Scene::apply_joined(absl::Span<const UpdateBatch* const> batches, Deadline until) {
  Acks acks;
  const std::vector<const UpdateBatch*> good = well_formed(batches, acks);
  while (true) {
    RETURN_IF_ERROR(wait_for_readers(until));
    const MutexLock lock(writer_mutex_);
    RETURN_IF_ERROR(check_open());
    if (pins_->over_budget()) continue;
    const auto log = [&journal = journal_, epoch = writer_.epoch(), &good] {
      return journal.append_joined(epoch, good);
    };
    ASSIGN_OR_RETURN(SceneWriter::Joined joined, writer_.apply_joined(good, log));
    LOCUS_DCHECK_EQ(joined.acks.size(), good.size());
    if (joined.snapshot != nullptr) publish(joined.snapshot);
    auto next = joined.acks.begin();
    for (absl::StatusOr<UpdateAck>& ack : acks)
      if (ack.ok()) ack = std::move(*next++);
    count_joined(acks);
    return acks;
  }
}

void Scene::count_joined(const Acks& acks) {
  const auto applied = std::count_if(acks.begin(), acks.end(),
                                     [](const absl::StatusOr<UpdateAck>& ack) { return ack.ok() && !ack->duplicate; });
  const MutexLock lock(mutex_);
  joined_updates_ += static_cast<uint64_t>(std::max<std::ptrdiff_t>(applied, 1) - 1);
}

absl::Status Scene::admit_change(const StaticChange& change) {
  const MutexLock lock(mutex_);
  if (closed_) return closed_status();
  if (pending_changes_ >= limits::kMaxPendingChanges)
    return refuse_full("scene", "pending_changes", limits::kMaxPendingChanges, pending_changes_ + 1.0, 100);
  ++pending_changes_;
  for (const PlacementColumns& place : change.place) add_mesh_to_place(place.mesh.get());
  LOCUS_DCHECK_CALL(check_invariants());
  return absl::OkStatus();
}

void Scene::leave_change(const StaticChange& change, const absl::Status& result) {
  const MutexLock lock(mutex_);
  LOCUS_DCHECK_GT(pending_changes_, 0u);
  --pending_changes_;
  for (const PlacementColumns& place : change.place) remove_mesh_to_place(place.mesh.get());
  if (!result.ok()) last_build_error_ = std::string(result.message());
  LOCUS_DCHECK_CALL(check_invariants());
}

void Scene::count_objects_in(ObjectCount count) {
  const MutexLock lock(mutex_);
  LOCUS_DCHECK(object_count_ == nullptr && !closed_);
  count->fetch_add(latest_->objects.size());
  object_count_ = std::move(count);
}

bool Scene::in_use(const StaticMesh* mesh) const {
  const MutexLock lock(mutex_);
  return latest_->statics->uses(mesh) > 0 || meshes_to_place_.contains(mesh);
}

void Scene::add_used_meshes(absl::flat_hash_set<const StaticMesh*>& meshes) const {
  SnapshotPtr snapshot;
  {
    const MutexLock lock(mutex_);
    for (const auto& [mesh, placements] : meshes_to_place_) meshes.insert(mesh);
    snapshot = latest_;
  }
  const StaticSet* last = nullptr;
  const auto add = [&](const StaticSet& statics) {
    if (&statics == last) return;
    last = &statics;
    const std::vector<const StaticMesh*> used = statics.meshes();
    meshes.insert(used.begin(), used.end());
  };
  if (snapshot->history != nullptr)
    for (const std::shared_ptr<const HistoryRecord>& record : snapshot->history->records) add(*record->statics);
  add(*snapshot->statics);
}

absl::Status Scene::check_kept(const StaticChange& change) const {
  for (size_t i = 0; is_kept_ != nullptr && i < change.place.size(); ++i)
    if (!is_kept_(change.place[i].mesh.get())) return mesh_is_gone(change, i);
  return absl::OkStatus();
}

absl::StatusOr<InstanceChange> Scene::change_instances(const StaticChange& change) {
  RETURN_IF_ERROR(admit_change(change));
  absl::StatusOr<InstanceChange> result = InstanceChange();
  if (absl::Status kept = check_kept(change); !kept.ok()) {
    result = std::move(kept);
  } else {
    const MutexLock change_lock(change_mutex_);
    result = build_and_publish(change);
  }
  leave_change(change, result.status());
  return result;
}

Id Scene::next_chosen_id() {
  const MutexLock lock(mutex_);
  return next_chosen_id_++;
}

std::vector<Id> Scene::choose_ids(size_t count) {
  const SnapshotPtr snapshot = latest();
  std::vector<Id> ids;
  ids.reserve(count);
  while (ids.size() < count) {
    const Id id = next_chosen_id();
    if (!snapshot->objects.find_ref(id) && snapshot->statics->find(id) == nullptr) ids.push_back(id);
  }
  return ids;
}

absl::StatusOr<InstanceChange> Scene::build_and_publish(const StaticChange& change) {
  RETURN_IF_ERROR(wait_for_readers(ReaderTracker::kNever));
  // Building the tree takes long. During this time, hold only the instances of the current revision, not its objects;
  // is_object() therefore searches the objects of the revision that is the latest at each call.
  const auto is_object = [this](Id id) { return static_cast<bool>(latest()->objects.find_ref(id)); };
  for (int build = 1;; ++build) {
    const std::shared_ptr<const StaticSet> statics = latest()->statics;
    ASSIGN_OR_RETURN(StaticSet::Changed changed,
                     statics->apply(change, is_object, [this] { return next_chosen_id(); }));
    const WhenRegrouped again = build < kMaxBuilds ? WhenRegrouped::kReturn : WhenRegrouped::kBuildHere;
    ASSIGN_OR_RETURN(std::optional<InstanceChange> result, publish_change(change, *statics, changed, again));
    if (result) return *std::move(result);
  }
}

absl::StatusOr<std::optional<InstanceChange>> Scene::publish_change(const StaticChange& change,
                                                                    const StaticSet& statics,
                                                                    StaticSet::Changed& changed, WhenRegrouped again) {
  const MutexLock lock(writer_mutex_);
  RETURN_IF_ERROR(check_open());
  // Update batches that were applied while the tree was being built may have moved and relabelled instances.
  if (const std::shared_ptr<const StaticSet>& updated = writer_.statics(); updated.get() != &statics) {
    if (!updated->regrouped_since(statics, change.remove_groups)) {
      changed.set = changed.set->with_updates(statics, *updated);
    } else if (again == WhenRegrouped::kReturn) {
      return std::nullopt;
    } else {
      const auto is_taken = [this](Id id) LOCUS_REQUIRES(writer_mutex_) { return writer_.is_object(id); };
      ASSIGN_OR_RETURN(changed, updated->apply(change, is_taken, [this] { return next_chosen_id(); }));
    }
  }
  // Objects inserted while the tree was being built may have taken an id.
  for (size_t i = 0; i < changed.placed.size(); ++i)
    if (writer_.is_object(changed.placed[i])) return taken_meanwhile(change, i, changed.placed[i]);
  RETURN_IF_ERROR(journal_.append_change(writer_.epoch(), change, changed.placed));
  SnapshotPtr snapshot = writer_.replace_statics(std::move(changed.set));
  InstanceChange result{std::move(changed.placed), snapshot->revision, snapshot->epoch};
  publish(snapshot);
  return result;
}

void Scene::check_invariants() const {
  LOCUS_CHECK(latest_ != nullptr && latest_->statics != nullptr);
  LOCUS_CHECK_LE(latest_->oldest_tick(), latest_->tick);
  LOCUS_CHECK(!recent_.empty() && recent_.back() == latest_);
  LOCUS_CHECK_LE(recent_.size(), size_t{limits::kRecentRevisions});
  LOCUS_CHECK_EQ(recent_.front()->revision + recent_.size() - 1, latest_->revision);
  LOCUS_CHECK(watches_.empty() || (!closed_ && watches_.begin()->first > latest_->revision));
}

void Scene::publish(const SnapshotPtr& snapshot) {
  std::vector<SnapshotPtr> retired;  // freed after the lock is released, because freeing takes long
  {
    const MutexLock lock(mutex_);
    LOCUS_DCHECK_EQ(snapshot->revision, latest_->revision + 1);
    LOCUS_DCHECK_EQ(snapshot->epoch, latest_->epoch);
    LOCUS_DCHECK_GE(snapshot->replaced_bytes, latest_->replaced_bytes);
    // If the number of objects has decreased, the unsigned difference wraps around; the sum is still correct modulo
    // 2^64.
    if (object_count_ != nullptr && !closed_)
      object_count_->fetch_add(uint64_t{snapshot->objects.size()} - uint64_t{latest_->objects.size()});
    latest_ = snapshot;
    recent_.push_back(snapshot);
    const auto too_much = [&] {
      return recent_.size() > limits::kRecentRevisions ||
             snapshot->replaced_bytes - recent_.front()->replaced_bytes > limits::kRecentBytes;
    };
    while (recent_.size() > 1 && too_much()) {
      retired.push_back(std::move(recent_.front()));
      recent_.pop_front();
    }
    published_.notify_all();
    notify_watches(snapshot->revision);
    LOCUS_DCHECK_CALL(check_invariants());
  }
  pins_->enforce_budget(*snapshot);
}

void Scene::notify_watches(uint64_t revision) {
  while (!watches_.empty() && watches_.begin()->first <= revision) {
    Watch& watch = *watches_.begin()->second;
    watches_.erase(watches_.begin());
    watch.notified_ = true;
    watch.notify_();
  }
}

Scene::Watch::Watch(const Scene& scene, uint64_t revision, std::function<void()> notify)
    : scene_(scene), notify_(std::move(notify)) {
  const MutexLock lock(scene_.mutex_);
  // NOLINTNEXTLINE(cppcoreguidelines-prefer-member-initializer): needs the lock
  notified_ = scene_.closed_ || scene_.latest_->revision >= revision;
  if (notified_)
    notify_();
  else
    position_ = scene_.watches_.emplace(revision, this);
}

Scene::Watch::~Watch() {
  const MutexLock lock(scene_.mutex_);
  if (!notified_) scene_.watches_.erase(position_);
}

SnapshotPtr Scene::latest() const {
  const MutexLock lock(mutex_);
  return latest_;
}

absl::StatusOr<SnapshotPtr> Scene::recent(uint64_t revision) const {
  const uint64_t oldest = recent_.front()->revision;
  if (revision < oldest || revision > latest_->revision) return outside_recent(oldest, latest_->revision, revision);
  LOCUS_DCHECK_LT(revision - oldest, recent_.size());
  LOCUS_DCHECK_EQ(recent_[revision - oldest]->revision, revision);
  return recent_[revision - oldest];
}

absl::StatusOr<SnapshotPtr> Scene::view(const View& view, Deadline deadline) const {
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

absl::StatusOr<SnapshotPin> Scene::pin(const View& view, Deadline deadline) const {
  ASSIGN_OR_RETURN(SnapshotPtr snapshot, this->view(view, deadline));
  return SnapshotPin(pins_, std::move(snapshot));
}

void Scene::forget_recent() {
  std::deque<SnapshotPtr> forgotten;  // freed after the lock is released, because freeing takes long
  const MutexLock lock(mutex_);
  forgotten.swap(recent_);
  recent_.push_back(latest_);
  LOCUS_DCHECK_CALL(check_invariants());
}

void Scene::forget_mesh(const StaticMesh* mesh) {
  std::deque<SnapshotPtr> forgotten;  // freed after the locks are released, because freeing takes long
  const MutexLock writer_lock(writer_mutex_);
  // The writer's instances are those of the latest revision while the writer's lock is held.
  if (writer_.statics()->uses(mesh) > 0) return;  // placed again, by a change that began before the deletion
  const SnapshotPtr trimmed = writer_.forget_mesh(mesh);
  const MutexLock lock(mutex_);
  if (trimmed != nullptr) {
    LOCUS_DCHECK_EQ(trimmed->revision, latest_->revision);
    forgotten.swap(recent_);
    latest_ = trimmed;
    recent_.push_back(trimmed);
    LOCUS_DCHECK_CALL(check_invariants());
    return;
  }
  const auto last = std::find_if(recent_.rbegin(), recent_.rend(),
                                 [mesh](const SnapshotPtr& recent) { return recent->statics->uses(mesh) > 0; });
  std::move(recent_.begin(), last.base(), std::back_inserter(forgotten));
  recent_.erase(recent_.begin(), last.base());
  LOCUS_DCHECK_CALL(check_invariants());
}

uint64_t Scene::revoke_readers(uint64_t bytes) {
  const uint64_t revoked = pins_->revoke_beyond(*latest(), bytes);
  pins_->revoke_overdue();
  return revoked;
}

uint64_t Scene::trim_history(uint64_t bytes) {
  std::deque<SnapshotPtr> forgotten;  // freed after the locks are released, because freeing takes long
  const MutexLock writer_lock(writer_mutex_);
  const SnapshotPtr trimmed = writer_.trim_history(bytes);
  if (trimmed == nullptr) return 0;
  const MutexLock lock(mutex_);
  LOCUS_DCHECK_EQ(trimmed->revision, latest_->revision);
  const uint64_t before = latest_->history->bytes;
  forgotten.swap(recent_);
  latest_ = trimmed;
  recent_.push_back(trimmed);
  LOCUS_DCHECK_CALL(check_invariants());
  return before - (trimmed->history == nullptr ? 0 : trimmed->history->bytes);
}

void Scene::close(const absl::Status& why) {
  const MutexLock lock(mutex_);
  if (!closed_) close_reason_ = why;
  if (object_count_ != nullptr && !closed_) object_count_->fetch_sub(latest_->objects.size());
  closed_ = true;
  pins_->close();
  published_.notify_all();
  notify_watches(std::numeric_limits<uint64_t>::max());
  LOCUS_DCHECK_CALL(check_invariants());
}

absl::Status Scene::remove() {
  return remove_if([] { return true; }).status();
}

absl::StatusOr<bool> Scene::remove_if(absl::FunctionRef<bool()> condition) {
  const MutexLock lock(writer_mutex_);  // held so that nothing is logged or acknowledged after the deletion
  RETURN_IF_ERROR(check_open());
  if (!condition()) return false;
  RETURN_IF_ERROR(journal_.remove());
  close();
  return true;
}

FrozenScene Scene::freeze() {
  const MutexLock lock(writer_mutex_);
  return {writer_.published(),          writer_.writers(),      writer_.has_past(),
          journal_.position().sequence, journal_.total_bytes(), writer_.lease_table()};
}

SceneStatus Scene::status() const {
  SceneStatus status;
  SnapshotPtr snapshot;
  {
    const MutexLock lock(mutex_);
    status.pending_changes = pending_changes_;
    status.joined_updates = joined_updates_;
    status.last_build_error = last_build_error_;
    snapshot = latest_;
    status.recent_bytes = latest_->replaced_bytes - recent_.front()->replaced_bytes;
  }
  status.memory_bytes = bytes_of(*snapshot);
  status.mesh_bytes = snapshot->statics->mesh_bytes();
  const ReaderTracker::Use pinned = pins_->use(*snapshot, status.memory_bytes);
  status.pinned_bytes = pinned.held;
  status.max_pinned_bytes = pinned.budget;
  status.past_limit = snapshot->past_limit;
  status.forgotten_ticks = snapshot->forgotten_ticks;
  if (snapshot->history != nullptr) {
    status.history_bytes = snapshot->history->bytes;
    status.recorded_ticks = static_cast<uint32_t>(snapshot->history->records.size());
  }
  return status;
}

std::optional<SceneSummary> Scene::known_summary() const {
  const MutexLock lock(mutex_);
  return summarized_.lock() == latest_ ? summary_ : std::nullopt;
}

SceneSummary Scene::summary() const {
  const uint64_t asked = latest()->revision;
  const MutexLock summarizing(summarizing_mutex_);
  SnapshotPtr snapshot;
  {
    const MutexLock lock(mutex_);
    snapshot = latest_;
    // Comparing revisions is not enough: trim_history() replaces the snapshot of a revision by one with a shorter
    // history.
    if (summary_ && (summary_->revision > asked || summarized_.lock() == snapshot)) return *summary_;
  }
  const SceneSummary made = summarize(*snapshot);
  const MutexLock lock(mutex_);
  summary_ = made;
  summarized_ = snapshot;
  return made;
}

}  // namespace locus
