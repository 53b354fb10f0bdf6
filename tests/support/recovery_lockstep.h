// Comparison of a scene with its model. The scene has a log; the model is a scene without a log. The test applies every
// kind of event to the scene: random batches one at a time, several batches by apply_joined() or apply_each(), static
// changes, snapshots, a full disk, and crashes. After a crash, the scene is restored from its log. The model applies
// exactly the changes that were logged, one call after another.
#ifndef LOCUS_TESTS_SUPPORT_RECOVERY_LOCKSTEP_H_
#define LOCUS_TESTS_SUPPORT_RECOVERY_LOCKSTEP_H_

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/scene/log/state_writer.h"
#include "core/scene/recovery.h"
#include "tests/support/memory_log.h"
#include "tests/support/random_updates.h"
#include "tests/support/scene_difference.h"

namespace locus::test {

class RecoveryLockstep {
 public:
  explicit RecoveryLockstep(uint64_t seed)
      : random_(seed), updates_(random_, kIds), log_(std::make_unique<MemoryLog>()) {
    spec_.labels = {{"seed", absl::StrCat(seed)}};
    spec_.durability = random_.chance(0.7) ? Durability::kLocal : Durability::kMemory;
    if (random_.chance(0.5)) spec_.history = {static_cast<uint32_t>(1 + random_.below(40)), uint64_t{1} << 30};
    for (uint8_t content = 1; content <= 2; ++content) meshes_.push_back(one_triangle(content));
    Registry registry(log_.get());
    scene_ = registry.create_scene("lockstep", spec_, kEpoch, "", false)->scene;
    scene_->check_meshes(nullptr);
    model_ = new_model();
  }

  // Returns the first difference; empty if there is none.
  std::string run(int steps) {
    for (int step = 0; step < steps; ++step) {
      std::string what = take_step();
      if (what.empty()) what = scene_difference(*scene_, *model_, random_);
      if (what.empty()) what = follow();
      if (!what.empty()) return absl::StrCat("step ", step, ": ", what);
    }
    return "";
  }

  uint64_t crashes() const { return crashes_; }
  // Returns the number of followed records, and how often the follower became the leader.
  uint64_t followed() const { return followed_; }
  uint64_t promotions() const { return promotions_; }
  uint64_t lost() const { return lost_; }
  uint64_t turned_up() const { return turned_up_; }

 private:
  static constexpr uint64_t kIds = 60;
  static constexpr uint64_t kEpoch = 5;
  static constexpr uint64_t kAllRecords = 1'000'000;

  // Change of instances: the instance to remove and the instance to place.
  struct Change {
    Id removed = kNoId;
    std::optional<Id> placed;  // id of the placed instance, which the scene may have chosen in advance
    size_t mesh = 0;
    Vec3d translation;
  };
  struct Deed {
    std::vector<UpdateBatch> batches;  // one batch; several if joined; none for a change of instances
    bool joined = false;
    std::optional<Change> change;
    uint64_t end_lease = 0;  // writer whose lease ends; the deed has no batches then
  };

  static MeshPtr one_triangle(uint8_t content) {
    Sha256 sha256{};
    sha256[0] = content;
    return *StaticMesh::build("triangle", sha256, *TriangleMesh::create({0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}, {}));
  }
  std::unique_ptr<Scene> new_model() const {
    return std::make_unique<Scene>("lockstep", spec_, kEpoch, StaticSet::empty());
  }

  std::string take_step() {
    if (random_.chance(0.03)) return crash();
    if (random_.chance(0.03)) begin_snapshot();
    if (random_.chance(0.1)) end_snapshot();
    const bool full = random_.chance(0.05);
    if (full) log_->fail_with(absl::ResourceExhaustedError("the disk is full"));
    std::string what = change_scene();
    if (!full) return what;
    log_->fail_with(absl::OkStatus());
    return what.empty() && random_.chance(0.3) ? crash() : what;
  }

  MeshPtr mesh_of(const Sha256& sha256) const {
    return sha256[0] == 0 || sha256[0] > meshes_.size() ? nullptr : meshes_[size_t{sha256[0]} - 1];
  }

  // Applies to a follower the records that it does not have yet, and compares it with the model. Begins another
  // follower at times, and lets a follower become the leader at others.
  std::string follow() {
    if (follower_ == nullptr || random_.chance(0.02)) {
      const StoredScene stored = MemoryLog(log_->crash(kAllRecords)).stored_scenes().front();
      absl::StatusOr<ScenePtr> begun = recover_scene(
          *log_, stored, [this](const MeshKey& key) { return mesh_of(key.sha256); }, nullptr, LogUse::kReadOnly);
      if (!begun.ok()) return absl::StrCat("beginning to follow: ", begun.status().ToString());
      follower_ = *std::move(begun);
      followed_sequence_ = stored.last_sequence;
    }
    const auto apply_next = [this](const LogRecord& record) -> absl::Status {
      const auto find = [this](const MeshKey& key, const Aabbf*) { return mesh_of(key.sha256); };
      if (absl::Status status = follower_->follow(record.entry, find).status(); !status.ok()) return status;
      ++followed_;
      followed_sequence_ = record.sequence;
      return absl::OkStatus();
    };
    if (absl::Status read = log_->read(scene_->log_key(), followed_sequence_ + 1, apply_next); !read.ok())
      return absl::StrCat("following: ", read.ToString());
    if (std::string what = scene_difference(*follower_, *model_, random_); !what.empty())
      return absl::StrCat("the follower: ", what);
    if (!random_.chance(0.02)) return "";
    ++promotions_;
    snapshot_.reset();
    const SceneLog log{log_.get(), scene_->log_key(), ack_level(spec_.durability), scene_->log_position()};
    scene_ = std::move(follower_);
    scene_->begin_leading(log);
    return "";
  }

  std::string change_scene() {
    const uint64_t kind = random_.below(10);
    if (kind == 0) return change_instances();
    if (kind < 3) return apply_joined();
    if (kind == 9 && random_.chance(0.5)) return end_lease();
    if (kind < 5) return apply_each();
    return apply_one();
  }

  // Handles the result of a call of the scene. `deeds` are the changes that the call should log, and `before` is the
  // last sequence number before the call. Stores the deeds that were logged, or all deeds as tentative if the disk was
  // full. Sets `what` to a description of an error. Returns whether the model must apply the changes, too.
  bool logged(const absl::Status& status, std::vector<Deed> deeds, uint64_t before, std::string& what) {
    const uint64_t records = scene_->log_position().sequence - before;
    if (absl::IsResourceExhausted(status)) {
      if (records != 0) what = "records of a full disk";
      tentative_ = std::move(deeds);
      return false;
    }
    if (records > deeds.size()) what = "more records than deeds";
    if (records > 0) tentative_.clear();
    // Drop deeds that were not logged; they are at the front.
    deeds.erase(deeds.begin(), deeds.end() - static_cast<std::ptrdiff_t>(std::min<uint64_t>(records, deeds.size())));
    for (Deed& deed : deeds) deeds_.push_back(std::move(deed));
    return what.empty();
  }

  std::string apply_one() {
    const UpdateBatch batch = updates_.draw(columns_, 6);
    const uint64_t before = scene_->log_position().sequence;
    const absl::StatusOr<UpdateAck> ack = scene_->apply(batch);
    std::string what;
    if (!logged(ack.status(), {{{batch}, false, {}}}, before, what)) return what;
    return ack_difference(ack, model_->apply(batch));
  }

  std::string end_lease() {
    const uint64_t writer = updates_.draw_writer();
    const uint64_t before = scene_->log_position().sequence;
    const absl::StatusOr<std::optional<uint64_t>> ended = scene_->end_lease(writer, [] { return true; });
    std::string what;
    if (!logged(ended.status(), {{{}, false, {}, writer}}, before, what)) return what;
    return *ended == *model_->end_lease(writer, [] { return true; }) ? "" : "whether the lease of a writer ends";
  }

  std::string apply_each() {
    std::vector<UpdateBatch> batches;
    for (uint64_t i = 1 + random_.below(5); i > 0; --i) batches.push_back(updates_.draw(columns_, 4));
    if (random_.chance(0.3)) batches.push_back(batches.front());
    std::vector<const UpdateBatch*> borrowed;
    std::vector<Deed> deeds;
    for (const UpdateBatch& batch : batches) {
      borrowed.push_back(&batch);
      deeds.push_back({{batch}, false, {}});
    }
    const uint64_t before = scene_->log_position().sequence;
    const uint64_t appends = log_->appends();
    const absl::StatusOr<Scene::Acks> acks = scene_->apply_each(borrowed);
    if (log_->appends() > appends + 1) return "more than one append";
    if (!acks.ok()) {
      const WriterTable writers = model_->freeze().writers;
      const auto is_new = [&writers](const UpdateBatch& batch) {
        const absl::StatusOr<std::optional<UpdateAck>> known = writers.admit(batch.writer, batch.batch);
        return known.ok() && !*known;
      };
      while (!is_new(deeds.front().batches[0])) deeds.erase(deeds.begin());
    }
    std::string what;
    if (!logged(acks.status(), std::move(deeds), before, what)) return what;
    for (size_t i = 0; i < batches.size() && what.empty(); ++i)
      what = ack_difference((*acks)[i], model_->apply(batches[i]));
    return what;
  }

  std::string apply_joined() {
    std::vector<UpdateBatch> batches;
    const std::optional<uint64_t> tick = random_.chance(0.5) ? std::optional(random_.below(50)) : std::nullopt;
    for (uint64_t i = 1 + random_.below(4); i > 0; --i) batches.push_back(draw_joinable(tick));
    if (random_.chance(0.2)) batches.push_back(batches.front());
    const uint64_t before = scene_->log_position().sequence;
    const absl::StatusOr<Scene::Acks> acks = joined(*scene_, batches);
    std::string what;
    if (!logged(acks.status(), {{batches, true, {}}}, before, what)) return what;
    const absl::StatusOr<Scene::Acks> expected = joined(*model_, batches);
    for (size_t i = 0; i < batches.size() && what.empty(); ++i) what = ack_difference((*acks)[i], (*expected)[i]);
    return what;
  }

  UpdateBatch draw_joinable(std::optional<uint64_t> tick) {
    UpdateBatch batch;
    while (batch.moves.empty()) batch = updates_.draw(columns_, 6);
    batch.clear = batch.all_or_nothing = batch.restart_ticks = false;
    batch.tick = tick;
    batch.lease_ms = 0;
    batch.earlier.clear();
    batch.remove_ids = batch.remove_groups = {};
    batch.inserts.clear();
    batch.relabels.clear();
    batch.instance_moves.clear();
    batch.instance_relabels.clear();
    for (MoveColumns& move : batch.moves) {
      move.teleport = false;
      move.parts_each = 0;
      move.part_positions = move.part_rotations = {};
    }
    return batch;
  }

  static absl::StatusOr<Scene::Acks> joined(Scene& scene, const std::vector<UpdateBatch>& batches) {
    std::vector<const UpdateBatch*> borrowed;
    for (const UpdateBatch& batch : batches) borrowed.push_back(&batch);
    return scene.apply_joined(borrowed);
  }

  std::string change_instances() {
    Change change;
    if (random_.chance(0.5)) change.removed = random_instance();
    if (random_.chance(0.9)) change.placed = random_.chance(0.5) ? random_.below(kIds) : scene_->choose_ids(1).front();
    change.mesh = random_.below(meshes_.size());
    change.translation = random_.vector(100);
    const uint64_t before = scene_->log_position().sequence;
    const absl::StatusOr<InstanceChange> changed = apply(*scene_, change);
    std::string what;
    if (!logged(changed.status(), {{{}, false, change}}, before, what)) return what;
    const absl::StatusOr<InstanceChange> expected = apply(*model_, change);
    if (changed.status() != expected.status()) return "status of a static change";
    return !changed.ok() || changed->placed == expected->placed ? "" : "ids of placed instances";
  }

  Id random_instance() {
    const auto instances = model_->latest()->statics->tree().values();
    return instances.empty() || random_.chance(0.1)
               ? random_.below(kIds)
               : std::next(instances.begin(), static_cast<std::ptrdiff_t>(random_.below(instances.size())))->id;
  }

  absl::StatusOr<InstanceChange> apply(Scene& scene, const Change& change) const {
    StaticChange columns;
    if (change.removed != kNoId) columns.remove_ids = {&change.removed, 1};
    if (change.placed) {
      PlacementColumns& place = columns.place.emplace_back();
      place.mesh = meshes_[change.mesh];
      place.ids = {&*change.placed, 1};
      place.translations = {&change.translation.x, 3};
    }
    return scene.change_instances(columns);
  }

  void begin_snapshot() {
    FrozenScene frozen = scene_->freeze();
    frozen_sequence_ = frozen.sequence;
    frozen_bytes_ = frozen.log_bytes;
    snapshot_.emplace(std::move(frozen));
  }

  void end_snapshot() {
    if (!snapshot_) return;
    const absl::Status status =
        log_->write_snapshot(scene_->log_key(), frozen_sequence_, [this] { return snapshot_->next(); });
    LOCUS_CHECK(status.ok());
    scene_->snapshot_written(frozen_sequence_, frozen_bytes_);
    snapshot_.reset();
  }

  // Simulates a crash and restores the scene. With durability kLocal, the restored scene must contain every
  // acknowledged change.
  std::string crash() {
    ++crashes_;
    follower_ = nullptr;  // it may have followed records that the log loses
    snapshot_.reset();
    const uint64_t acknowledged = scene_->log_position().sequence;
    const bool memory = spec_.durability == Durability::kMemory;
    log_ = std::make_unique<MemoryLog>(log_->crash(memory ? random_.below(20) : 0, random_.below(4)));
    const StoredScene& stored = log_->stored_scenes().front();
    if (!memory && stored.last_sequence < acknowledged) return "the log lost something";
    absl::StatusOr<ScenePtr> recovered =
        recover_scene(*log_, stored, [this](const MeshKey& key) { return mesh_of(key.sha256); });
    if (!recovered.ok()) return recovered.status().ToString();
    scene_ = *std::move(recovered);
    if (scene_->spec().labels != spec_.labels) return "labels";
    if (stored.last_sequence < acknowledged) lost_ += acknowledged - stored.last_sequence;
    for (uint64_t i = acknowledged; i < stored.last_sequence; ++i, ++turned_up_)
      deeds_.push_back(tentative_[i - acknowledged]);
    tentative_.clear();
    deeds_.resize(stored.last_sequence);
    return redo();
  }

  std::string redo() {
    model_ = new_model();
    for (const Deed& deed : deeds_) {
      if (deed.change && !apply(*model_, *deed.change).ok()) return "a static change that was logged is refused";
      if (deed.end_lease != 0)
        model_->end_lease(deed.end_lease, [] { return true; }).IgnoreError();
      else if (deed.joined)
        joined(*model_, deed.batches).IgnoreError();
      else if (!deed.change)
        model_->apply(deed.batches.front()).IgnoreError();
    }
    return "";
  }

  Random random_;
  Columns columns_;
  RandomUpdates updates_;
  SceneSpec spec_;
  std::vector<MeshPtr> meshes_;
  std::unique_ptr<MemoryLog> log_;
  ScenePtr scene_;
  ScenePtr follower_;               // null until the first step, and after a crash
  uint64_t followed_sequence_ = 0;  // of the last record that the follower has
  uint64_t followed_ = 0;
  uint64_t promotions_ = 0;
  std::unique_ptr<Scene> model_;
  std::vector<Deed> deeds_;      // deeds (changes of the scene), one for each record of the log
  std::vector<Deed> tentative_;  // deeds of the last append, if it failed
  std::optional<StateWriter> snapshot_;
  uint64_t frozen_sequence_ = 0;
  uint64_t frozen_bytes_ = 0;
  uint64_t crashes_ = 0;
  uint64_t lost_ = 0;
  uint64_t turned_up_ = 0;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RECOVERY_LOCKSTEP_H_
