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

absl::StatusOr<SceneWriter> SceneWriter::restore(SceneState state, Winding winding, const HistoryOptions& history) {
  SceneWriter writer(state.epoch, winding, std::move(state.statics), limits::kMaxObjects, history);
  if (!writer.objects_.fill(std::move(state.objects), state.cell_size))
    return absl::DataLossError("two objects have the same id");
  for (const Instance& instance : writer.statics_->tree().values())
    if (writer.is_object(instance.id))
      return absl::DataLossError(absl::StrCat("the id ", instance.id, " belongs to an object and to an instance"));
  writer.revision_ = state.revision;
  writer.tick_ = state.tick;
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
      replaced_bytes_ + recorder_.dropped_bytes(), recorder_.limit(), recorder_.forgotten_ticks()});
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
  absl::StatusOr<Applied> result = MoveApplier::serves(batch) && !teleports ? apply_moves(batch) : apply_changes(batch);
  if (result.ok()) writers_.record(batch.writer, batch.batch, result->ack);
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
    if (result.ack.errors.size() < limits::kMaxListedItemErrors) result.ack.errors.push_back(std::move(error));
  if (!batch.all_or_nothing || result.ack.refused == 0) return absl::OkStatus();
  const ItemError& first = result.ack.errors.front();
  return refuse_argument(
      first.reason, first.field, first.index,
      absl::StrCat(reason_name(first.reason), ", id ", first.id, "; all_or_nothing refuses the batch because of ",
                   result.ack.refused, " refused items"));
}

absl::StatusOr<SceneWriter::Applied> SceneWriter::apply_moves(const UpdateBatch& batch) {
  Applied result;
  moves_.run(objects_, batch);
  InstanceApplier instances(*statics_, batch, track_lifetimes());
  instances.run();
  RETURN_IF_ERROR(fill_ack(batch, moves_, instances, result));
  result.snapshot = publish_moves(batch, &instances);
  set_revision(result.ack);
  return result;
}

absl::StatusOr<SceneWriter::Applied> SceneWriter::apply_changes(const UpdateBatch& batch) {
  Applied result;
  flush_coalesced_moves();
  BatchApplier applier(objects_, *statics_, batch, track_lifetimes());
  applier.run();
  if (applier.object_count() > max_objects_)
    return refuse_full("inserts", "objects", static_cast<double>(max_objects_),
                       static_cast<double>(applier.object_count()), 0);
  InstanceApplier instances(*statics_, batch, track_lifetimes());
  instances.run();
  RETURN_IF_ERROR(fill_ack(batch, applier, instances, result));
  const BatchApplier::Difference difference = applier.difference();
  const bool dropped_history = drops_history(batch);
  start_tick(batch);
  replaced_bytes_ += objects_.apply(difference.removed, difference.added, difference.replaced);
  const bool instances_change = apply_instances(instances);
  publish_changes(batch, !difference.empty() || instances_change || dropped_history, result);
  return result;
}

absl::StatusOr<SceneWriter::Joined> SceneWriter::apply_joined(absl::Span<const UpdateBatch* const> batches,
                                                              absl::FunctionRef<absl::Status()> log) {
  Joined joined;
  std::vector<bool> is_new;
  const UpdateBatch* any_new = nullptr;
  moves_.begin(objects_);
  for (const UpdateBatch* batch : batches) {
    LOCUS_DCHECK(check_form(*batch).ok() && may_join(*batches.front(), *batch));
    const absl::StatusOr<std::optional<UpdateAck>> known = writers_.admit(batch->writer, batch->batch);
    is_new.push_back(known.ok() && !*known);
    joined.acks.push_back(known.ok() ? absl::StatusOr<UpdateAck>(known->value_or(UpdateAck())) : known.status());
    if (!is_new.back()) continue;
    if (any_new == nullptr) RETURN_IF_ERROR(log());
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
  if (any_new != nullptr) joined.snapshot = publish_moves(*any_new, nullptr);
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

SnapshotPtr SceneWriter::publish_moves(const UpdateBatch& batch, InstanceApplier* instances) {
  Applied result;
  start_tick(batch);
  bool changes = apply_staged_moves();
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
