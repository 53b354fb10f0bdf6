#include "core/scene/scene_writer.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/limits.h"
#include "core/base/planted_bug.h"
#include "core/base/status_macros.h"
#include "core/scene/updates/batch_applier.h"

namespace locus {

SceneWriter::SceneWriter(uint64_t epoch, Winding winding, std::shared_ptr<const StaticSet> statics, size_t max_objects,
                         const HistoryOptions& history)
    : epoch_(epoch), max_objects_(max_objects), winding_(winding), statics_(std::move(statics)), recorder_(history) {
  LOCUS_DCHECK(statics_ != nullptr);
  LOCUS_DCHECK_NE(epoch_, uint64_t{0});
  if (recorder_.on()) objects_.track_lifetimes();
  published_ = freeze();
  LOCUS_DCHECK_CALL(check_invariants());
}

void SceneWriter::check_invariants() const {
  LOCUS_CHECK(published_ != nullptr || defer_snapshots());
  if (published_ != nullptr) {
    LOCUS_CHECK_EQ(published_->revision, revision_);
    LOCUS_CHECK_EQ(published_->tick, tick_);
    LOCUS_CHECK(replaying_ || published_->epoch == epoch_);
    LOCUS_CHECK(published_->statics == statics_);
  }
  LOCUS_CHECK(coalesced_moves_.empty() || defer_snapshots());
}

absl::StatusOr<SceneWriter> SceneWriter::restore(SceneState state, Winding winding, const HistoryOptions& history,
                                                 double cell_size) {
  SceneWriter writer(state.epoch, winding, std::move(state.statics), limits::kMaxObjects, history);
  if (cell_size != 0) writer.fix_cell_size(cell_size);
  if (!writer.objects_.fill(std::move(state.objects), state.cell_size))
    return absl::DataLossError("two objects have the same id");
  for (const Instance& instance : writer.statics_->tree().values())
    if (writer.is_object(instance.id))
      return absl::DataLossError(absl::StrCat("the id ", instance.id, " belongs to an object and to an instance"));
  writer.revision_ = state.revision;
  writer.tick_ = state.tick;
  for (const auto& [id, remaining] : state.expiries) {
    const uint32_t handle = writer.objects_.handle(id);
    if (handle == ObjectStore::kNoHandle || !writer.expiries_.set(handle, state.tick, remaining))
      return absl::DataLossError(absl::StrCat("the object ", id, " expires twice, or does not exist"));
  }
  for (const SceneState::StoredLease& lease : state.leases) {
    writer.leases_.begin(lease.writer, lease.lease_ms);
    for (const Id id : lease.ids) {
      const uint32_t handle = writer.objects_.handle(id);
      if (handle == ObjectStore::kNoHandle || writer.leases_.owner(handle) != 0)
        return absl::DataLossError(absl::StrCat("the object ", id, " belongs to two leases, or does not exist"));
      writer.leases_.give(handle, lease.writer);
    }
  }
  writer.writers_ = std::move(state.writers);
  writer.recorder_.restore(state.has_past);
  writer.published_ = writer.freeze();
  LOCUS_DCHECK_CALL(writer.check_invariants());
  return writer;
}

void SceneWriter::end_replay() {
  LOCUS_DCHECK(replaying_);
  flush_coalesced_moves();
  replaying_ = false;
  published_ = freeze();
  LOCUS_DCHECK_CALL(check_invariants());
}

void SceneWriter::restart(uint64_t epoch) {
  LOCUS_DCHECK_NE(epoch, uint64_t{0});
  epoch_ = epoch;
  if (!replaying_) published_ = freeze();
  LOCUS_DCHECK_CALL(check_invariants());
}

SnapshotPtr SceneWriter::freeze() {
  const bool stale = planted(PlantedBug::kStaleSnapshot) && published_ != nullptr;
  ObjectSet objects = stale ? published_->objects : objects_.snapshot();
  recorder_.measure(objects, *statics_);
  return std::make_shared<const SceneSnapshot>(SceneSnapshot{
      epoch_, revision_, tick_, winding_, statics_, std::move(objects), recorder_.history(), objects_.displacement(),
      replaced_bytes_ + recorder_.dropped_bytes(), recorder_.limit(), recorder_.forgotten_ticks(), expiries_.table()});
}

SnapshotPtr SceneWriter::next_revision() {
  ++revision_;
  published_ = defer_snapshots() ? nullptr : freeze();
  return published_;
}

SnapshotPtr SceneWriter::trim_history(uint64_t bytes) {
  if (replaying_ || !recorder_.trim(bytes)) return nullptr;
  published_ = freeze();
  LOCUS_DCHECK_CALL(check_invariants());
  return published_;
}

SnapshotPtr SceneWriter::forget_mesh(const StaticMesh* mesh) {
  if (replaying_ || !recorder_.forget_mesh(mesh)) return nullptr;
  published_ = freeze();
  LOCUS_DCHECK_CALL(check_invariants());
  return published_;
}

SnapshotPtr SceneWriter::replace_statics(std::shared_ptr<const StaticSet> statics) {
  LOCUS_DCHECK(statics != nullptr);
  replaced_bytes_ += statics_->unshared_bytes(*statics);
  statics_ = std::move(statics);
  SnapshotPtr snapshot = next_revision();
  LOCUS_DCHECK_CALL(check_invariants());
  return snapshot;
}

void SceneWriter::set_revision(UpdateAck& ack) const {
  ack.epoch = epoch_;
  ack.revision = revision_;
  ack.tick = tick_;
}

absl::StatusOr<SceneWriter::Admission> SceneWriter::admit(const UpdateBatch& batch) const {
  LOCUS_DCHECK(check_form(batch).ok());
  ASSIGN_OR_RETURN(Admission known, writers_.admit(batch.writer, batch.batch));
  if (known && known->epoch == 0) set_revision(*known);
  return known;
}

absl::StatusOr<SceneWriter::Applied> SceneWriter::apply(const UpdateBatch& batch) {
  ASSIGN_OR_RETURN(Admission known, admit(batch));
  if (known) return Applied{*std::move(known), nullptr};
  return apply_new(batch);
}

absl::StatusOr<SceneWriter::Applied> SceneWriter::apply_new(const UpdateBatch& batch) {
  LOCUS_DCHECK(writers_.admit(batch.writer, batch.batch).ok() && !*writers_.admit(batch.writer, batch.batch));
  const bool teleports = recorder_.on() && std::any_of(batch.moves.begin(), batch.moves.end(),
                                                       [](const MoveColumns& move) { return move.teleport; });
  if (batch.lease_ms != 0 && !leases_.has(batch.writer) && leases_.size() >= limits::kMaxLeases)
    return refuse_full("lease_ms", "leases", limits::kMaxLeases, static_cast<double>(leases_.size() + 1), 0);
  const bool expires = !planted(PlantedBug::kExpiryUnmoved) && expiries_.due(tick_of(batch));
  const bool moves = MoveApplier::serves(batch) && !teleports && !expires;
  if (planted(PlantedBug::kHalfGroup) && !batch.earlier.empty())
    if (absl::StatusOr<Applied> half = apply_changes(batch.earlier.front()); half.ok()) return half;
  ASSIGN_OR_RETURN(Applied result, moves ? apply_moves(batch) : apply_changes(batch));
  if (batch.lease_ms != 0) leases_.begin(batch.writer, batch.lease_ms);
  if (batch.end_lease != 0) leases_.end(batch.end_lease);
  writers_.record(batch.writer, batch.batch, result.ack);
  LOCUS_DCHECK_CALL(check_invariants());
  return result;
}

template <class Applier>
absl::Status SceneWriter::fill_ack(const UpdateBatch& batch, Applier& applier, InstanceApplier& instances,
                                   Applied& result) {
  result.ack.applied = applier.applied() + instances.applied();
  result.ack.refused = applier.refused() + instances.refused();
  result.ack.errors = std::move(applier.errors());
  for (ItemError& error : instances.errors())
    if (!batch.earlier.empty() || result.ack.errors.size() < limits::kMaxListedItemErrors)
      result.ack.errors.push_back(std::move(error));
  if (!batch.earlier.empty()) {
    // Each applier lists its errors in order of application, so the first errors of both are among them.
    std::stable_sort(result.ack.errors.begin(), result.ack.errors.end(),
                     [](const ItemError& a, const ItemError& b) { return a.message < b.message; });
    result.ack.errors.resize(std::min<size_t>(result.ack.errors.size(), limits::kMaxListedItemErrors));
  }
  if (!batch.all_or_nothing || result.ack.refused == 0) return absl::OkStatus();
  const ItemError& first = result.ack.errors.front();
  return refuse_argument(
      first.reason, first.field, first.index,
      absl::StrCat(reason_name(first.reason), ", id ", first.id,
                   batch.earlier.empty() ? "" : absl::StrCat(" in message ", first.message),
                   "; all_or_nothing refuses the batch because of ", result.ack.refused, " refused items"));
}

absl::StatusOr<SceneWriter::Applied> SceneWriter::apply_moves(const UpdateBatch& batch) {
  Applied result;
  moves_.run(objects_, batch);
  InstanceApplier instances(*statics_, batch, track_lifetimes());
  instances.run();
  RETURN_IF_ERROR(fill_ack(batch, moves_, instances, result));
  start_tick(batch);
  result.snapshot = publish_moves(batch, &instances, false);
  set_revision(result.ack);
  return result;
}

absl::StatusOr<SceneWriter::Applied> SceneWriter::apply_changes(const UpdateBatch& batch) {
  Applied result;
  flush_coalesced_moves();
  BatchApplier applier(objects_, *statics_, batch, track_lifetimes());
  if (changes_lifetimes(batch)) applier.record_inserted();
  remove_ended(batch, applier);
  applier.run();
  if (applier.object_count() > max_objects_)
    return refuse_full("inserts", "objects", static_cast<double>(max_objects_),
                       static_cast<double>(applier.object_count()), 0);
  InstanceApplier instances(*statics_, batch, track_lifetimes());
  instances.run();
  RETURN_IF_ERROR(fill_ack(batch, applier, instances, result));
  const bool dropped_history = drops_history(batch);
  start_tick(batch);
  const bool objects_change = apply_objects(batch, applier);
  const bool instances_change = apply_instances(instances);
  publish_changes(batch, objects_change || instances_change || dropped_history, result);
  return result;
}

bool SceneWriter::changes_lifetimes(const UpdateBatch& batch) const {
  const auto expires = [](const UpdateBatch& message) {
    return std::any_of(message.inserts.begin(), message.inserts.end(),
                       [](const InsertColumns& insert) { return !insert.expire_ticks.empty(); });
  };
  return !expiries_.empty() || !leases_.empty() || batch.lease_ms != 0 || expires(batch) ||
         std::any_of(batch.earlier.begin(), batch.earlier.end(), expires);
}

void SceneWriter::remove_ended(const UpdateBatch& batch, BatchApplier& applier) const {
  const uint64_t tick = tick_of(batch);
  if (!batch.restart_ticks && expiries_.due(tick))
    for (const uint32_t handle : expiries_.due_handles(tick)) applier.remove_first(objects_.at(handle).entry().id);
  if (batch.end_lease != 0)
    leases_.for_each(batch.end_lease, [&](uint32_t handle) { applier.remove_first(objects_.at(handle).entry().id); });
}

bool SceneWriter::apply_objects(const UpdateBatch& batch, BatchApplier& applier) {
  const BatchApplier::Difference difference = applier.difference();
  if (!changes_lifetimes(batch)) {
    replaced_bytes_ += objects_.apply(difference.removed, difference.added, difference.replaced);
    return !difference.empty();
  }
  std::vector<uint32_t> handles;
  handles.reserve(difference.removed.size());
  for (const Object& object : difference.removed) handles.push_back(objects_.handle(object.id));
  replaced_bytes_ += objects_.apply(difference.removed, difference.added, difference.replaced);
  follow_handles(difference.removed, handles, applier.inserted());
  const uint64_t tick = tick_of(batch);
  const uint64_t owner = batch.lease_ms != 0 || leases_.has(batch.writer) ? batch.writer : 0;
  bool expiries_change = false;
  // Objects that expired and were inserted again by this batch may have kept their handles.
  if (!batch.restart_ticks) {
    for (const uint32_t handle : expiries_.due_handles(tick)) {
      expiries_.erase(handle);
      expiries_change = true;
    }
  }
  for (const auto& [id, expire_ticks] : applier.inserted()) {
    const uint32_t handle = objects_.handle(id);
    LOCUS_DCHECK_NE(handle, ObjectStore::kNoHandle);
    expiries_change |= expiries_.set(handle, tick, expire_ticks);
    if (!planted(PlantedBug::kLeaseOfFirst) || leases_.owner(handle) == 0) leases_.give(handle, owner);
  }
  replaced_bytes_ += expiries_.take_replaced_bytes();
  return !difference.empty() || expiries_change;
}

void SceneWriter::follow_handles(absl::Span<const Object> removed, absl::Span<const uint32_t> handles,
                                 const absl::flat_hash_map<Id, uint64_t>& inserted) {
  for (size_t i = 0; i < removed.size(); ++i) {
    const uint32_t now = objects_.handle(removed[i].id);
    if (now == handles[i]) continue;
    if (now != ObjectStore::kNoHandle && !inserted.contains(removed[i].id)) {
      expiries_.transfer(handles[i], now);
      leases_.give(now, leases_.owner(handles[i]));
    }
    expiries_.erase(handles[i]);
    leases_.give(handles[i], 0);
  }
}

bool SceneWriter::expire(const UpdateBatch& batch) {
  if (!expiries_.due(tick_of(batch))) return false;
  flush_coalesced_moves();
  const std::vector<uint32_t> handles = expiries_.due_handles(tick_of(batch));
  std::vector<Object> removed;
  removed.reserve(handles.size());
  for (const uint32_t handle : handles) removed.push_back(object_of(objects_.at(handle)));
  replaced_bytes_ += objects_.apply(removed, {});
  follow_handles(removed, handles, {});
  return true;
}

absl::StatusOr<SceneWriter::Joined> SceneWriter::apply_joined(absl::Span<const UpdateBatch* const> batches,
                                                              absl::FunctionRef<absl::Status()> log) {
  Joined joined;
  std::vector<bool> is_new;
  const UpdateBatch* any_new = nullptr;
  bool expired = false;
  moves_.begin(objects_);
  for (const UpdateBatch* batch : batches) {
    LOCUS_DCHECK(check_form(*batch).ok() && may_join(*batches.front(), *batch));
    const absl::StatusOr<std::optional<UpdateAck>> known = writers_.admit(batch->writer, batch->batch);
    is_new.push_back(known.ok() && !*known);
    joined.acks.push_back(known.ok() ? absl::StatusOr<UpdateAck>(known->value_or(UpdateAck())) : known.status());
    if (!is_new.back()) continue;
    if (any_new == nullptr) {
      RETURN_IF_ERROR(log());
      start_tick(*batch);
      expired = expire(*batch);
    }
    any_new = batch;
    moves_.add(objects_, *batch);
    UpdateAck& ack = *joined.acks.back();
    ack.applied = moves_.applied();
    ack.refused = moves_.refused();
    ack.errors = std::move(moves_.errors());
    // Record the ack now, because a later element of `batches` may be the next batch of the same writer, or a duplicate
    // of this batch.
    writers_.record(batch->writer, batch->batch, ack);
  }
  moves_.finish(objects_);
  if (any_new != nullptr) joined.snapshot = publish_moves(*any_new, nullptr, expired);
  for (size_t i = 0; i < batches.size(); ++i) {
    // The ack of a duplicate has epoch 0 in two cases: the duplicate repeats an earlier element of `batches`, whose
    // revision is known only now, or the writer table has dropped the ack.
    if (is_new[i])
      record_ack(*batches[i], *joined.acks[i]);
    else if (joined.acks[i].ok() && joined.acks[i]->epoch == 0)
      set_revision(*joined.acks[i]);
  }
  LOCUS_DCHECK_CALL(check_invariants());
  return joined;
}

bool SceneWriter::apply_staged_moves() {
  if (defer_snapshots()) return coalesced_moves_.add(moves_.moves(), objects_);
  if (moves_.changes()) replaced_bytes_ += objects_.move(moves_.moves());
  return moves_.changes();
}

void SceneWriter::flush_coalesced_moves() {
  if (!coalesced_moves_.empty()) objects_.move(coalesced_moves_.moves());
  coalesced_moves_.clear();
}

bool SceneWriter::apply_instances(InstanceApplier& instances) {
  std::vector<Instance> changed = instances.changed();
  if (changed.empty()) return false;
  std::shared_ptr<const StaticSet> statics = statics_->replace(std::move(changed));
  replaced_bytes_ += statics_->unshared_bytes(*statics);
  statics_ = std::move(statics);
  return true;
}

SnapshotPtr SceneWriter::publish_moves(const UpdateBatch& batch, InstanceApplier* instances, bool changed) {
  Applied result;
  bool changes = apply_staged_moves() || changed;
  if (instances != nullptr) changes |= apply_instances(*instances);
  publish_changes(batch, changes, result);
  moves_.clear();
  return std::move(result.snapshot);
}

void SceneWriter::record_ack(const UpdateBatch& batch, UpdateAck& ack) {
  set_revision(ack);
  writers_.record(batch.writer, batch.batch, ack);
}

uint64_t SceneWriter::tick_of(const UpdateBatch& batch) const {
  if (!batch.tick) return tick_;
  return batch.restart_ticks ? *batch.tick : std::max(tick_, *batch.tick);
}

void SceneWriter::start_tick(const UpdateBatch& batch) {
  const uint64_t tick = tick_of(batch);
  if (batch.restart_ticks) expiries_.restart(tick_, tick);
  if (!recorder_.on() || (tick == tick_ && !batch.restart_ticks)) return;
  if (batch.restart_ticks) {
    recorder_.drop();
    return objects_.start_tick(tick, std::numeric_limits<uint64_t>::max());
  }
  LOCUS_DCHECK(published_ != nullptr);  // a scene with history never defers snapshots
  recorder_.close(tick_, published_->objects, published_->statics, objects_.displacement(), tick);
  objects_.start_tick(tick, recorder_.oldest_tick(tick));
}

void SceneWriter::publish_changes(const UpdateBatch& batch, bool changes, Applied& result) {
  const uint64_t tick = tick_of(batch);
  LOCUS_DCHECK(batch.restart_ticks || tick >= tick_);
  if (changes || tick != tick_) {
    tick_ = tick;
    result.snapshot = next_revision();
  }
  set_revision(result.ack);
}

}  // namespace locus
