// Random scenes with history whose instances move, jump, are relabelled, removed and placed, compared at random times
// with copies of all instances of every tick.
#ifndef LOCUS_TESTS_SUPPORT_DOOR_LOCKSTEP_H_
#define LOCUS_TESTS_SUPPORT_DOOR_LOCKSTEP_H_

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/query/query_batch.h"
#include "core/scene/scene.h"
#include "core/scene/snapshot/scene_at_time.h"
#include "tests/support/random.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {

class DoorLockstep {
 public:
  explicit DoorLockstep(uint64_t seed)
      : random_(seed), mesh_(make_mesh("door", 1)), scene_("doors", spec(), 1, StaticSet::empty()) {}

  // Returns the first difference; empty if there is none.
  std::string run(int ticks) {
    past_[0] = {};
    for (tick_ = 1; tick_ <= static_cast<uint64_t>(ticks); ++tick_) {
      if (random_.chance(0.4)) place_and_remove();
      if (!start_tick()) return "a batch was refused";
      past_[tick_] = doors_;
      while (past_.begin()->first < scene_.latest()->oldest_tick()) past_.erase(past_.begin());
      for (int i = 0; i < 3; ++i)
        if (std::string what = difference(); !what.empty()) return "tick " + std::to_string(tick_) + ": " + what;
    }
    return "";
  }

 private:
  static constexpr Id kIds = 150;
  struct Door {
    Vec3d position;
    Quaternion rotation;
    float scale = 1;
    Layers layers = kDefaultLayers;
    uint64_t life = 0;
  };
  using Doors = std::map<Id, Door>;

  static SceneSpec spec() {
    SceneSpec spec;
    spec.history = {20, uint64_t{1} << 30};
    return spec;
  }

  // Makes a static change of the current tick.
  void place_and_remove() {
    Columns columns;
    StaticChange change;
    std::vector<uint64_t> removed, placed;
    std::vector<double> at;
    for (Id id = 1; id <= kIds; ++id) {
      const bool is_there = doors_.contains(id);
      if (is_there && random_.chance(0.05)) removed.push_back(id);
      if (is_there ? !removed.empty() && removed.back() == id && random_.chance(0.5) : random_.chance(0.3)) {
        placed.push_back(id);
        for (int axis = 0; axis < 3; ++axis) at.push_back(random_.between(-50, 50));
      }
    }
    for (const Id id : removed) doors_.erase(id);
    for (size_t i = 0; i < placed.size(); ++i)
      doors_[placed[i]] = {{at[3 * i], at[3 * i + 1], at[3 * i + 2]}, {}, 1, kDefaultLayers, ++lives_};
    change.remove_ids = removed;
    if (!placed.empty()) {
      PlacementColumns& place = change.place.emplace_back();
      place.mesh = mesh_;
      place.ids = placed;
      place.translations = at;
    }
    LOCUS_CHECK(scene_.change_instances(change).ok());
    past_[tick_ - 1] = doors_;
  }

  // Begins tick_ with a batch that moves some of the doors.
  bool start_tick() {
    UpdateBatch batch;
    batch.tick = tick_;
    std::vector<uint64_t> ids, hidden;
    std::vector<double> positions;
    std::vector<float> rotations, scales;
    const bool jumps = random_.chance(0.2), turns = random_.chance(0.6), grows = random_.chance(0.4);
    for (auto& [id, door] : doors_) {
      if (random_.chance(0.1)) {
        hidden.push_back(id);
        door.layers = 0;
      }
      if (!random_.chance(0.4)) continue;
      ids.push_back(id);
      door.position = door.position + random_.vector(random_.chance(0.1) ? 40 : 2);
      positions.insert(positions.end(), {door.position.x, door.position.y, door.position.z});
      if (turns) {
        const Quaternion q = random_.rotation();
        rotations.insert(rotations.end(), {q.x, q.y, q.z, q.w});
        door.rotation = normalized(q);
      }
      if (grows) scales.push_back(door.scale = random_.float_between(0.5, 2));
      if (jumps) door.life = ++lives_;
    }
    InstanceMoveColumns& move = batch.instance_moves.emplace_back();
    move.ids = ids;
    move.positions_f64 = positions;
    move.rotations = rotations;
    move.scales = scales;
    move.teleport = jumps;
    const uint32_t none = 0;
    batch.instance_relabels.emplace_back().ids = hidden;
    if (!hidden.empty()) batch.instance_relabels[0].layers = {&none, 1};
    const absl::StatusOr<UpdateAck> ack = scene_.apply(batch);
    return ack.ok() && ack->refused == 0;
  }

  // Compares the instances at a random time with those of the copies.
  std::string difference() {
    const SnapshotPtr snapshot = scene_.latest();
    const AsOf time{snapshot->oldest_tick() + random_.below(snapshot->tick - snapshot->oldest_tick() + 1),
                    random_.chance(0.3) ? 0 : random_.float_between(0, 0.99)};
    const std::optional<SceneAtTime> moment = find_scene_at(*snapshot, time);
    if (!moment) return time.tick == snapshot->tick && time.fraction > 0 ? "" : "a time is not kept";
    const std::string when = " at " + std::to_string(time.tick) + " + " + std::to_string(time.fraction);
    const Doors& doors = past_.at(time.tick);
    const auto next = past_.find(time.tick + 1);
    if (moment->statics().size() != doors.size()) return "number of instances" + when;
    for (const auto& [id, door] : doors) {
      const Instance* const found = moment->statics().find(id);
      const std::string which = " of " + std::to_string(id) + when;
      if (found == nullptr) return "existence" + which;
      Door expected = door;
      const bool moves = time.fraction > 0 && next != past_.end() && next->second.contains(id) &&
                         next->second.at(id).life == door.life;
      if (moves) expected = between(door, next->second.at(id), time.fraction);
      if (squared_length(found->transform.translation - expected.position) > 1e-18) return "position" + which;
      const Quaternion &a = found->transform.quaternion, &b = expected.rotation;
      if (std::abs(a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w) < 1 - 1e-5f) return "rotation" + which;
      if (std::abs(found->transform.scale - expected.scale) > 1e-5f) return "scale" + which;
      if (found->layers != door.layers) return "layers" + which;
      if (found->bounds != bounds_to_world(found->transform, mesh_->bounds())) return "bounds" + which;
    }
    const std::string searched = search_difference(moment->statics());
    return searched.empty() ? "" : searched + when;
  }

  // Collects the instances whose bounds overlap a box.
  struct BoxSearch {
    Aabbd box;
    std::set<Id> found = {};
    Aabbd bounds() const { return box; }
    bool overlaps(const Aabbd& other) const { return locus::overlaps(box, other); }
    bool visit(const Instance& instance) { return found.insert(instance.id).second; }
  };

  // Searches the tree for the instances in random boxes, and compares them with those that find() returns.
  std::string search_difference(const StaticSet& statics) {
    for (int i = 0; i < 4; ++i) {
      const Vec3d corner = random_.vector(60);
      BoxSearch search{{corner, corner + Vec3d{1, 1, 1} * random_.between(0, 60)}};
      Work work;
      statics.tree().visit_region(search, work);
      for (Id id = 1; id <= kIds; ++id) {
        const Instance* const instance = statics.find(id);
        const bool expected = instance != nullptr && overlaps(search.box, instance->bounds);
        if (search.found.contains(id) != expected) return "search for " + std::to_string(id);
      }
    }
    return "";
  }

  static Door between(const Door& from, const Door& to, double weight) {
    Door door = from;
    door.position = from.position + (to.position - from.position) * weight;
    door.rotation = blended(from.rotation, to.rotation, weight);
    door.scale = static_cast<float>(double{from.scale} + (double{to.scale} - double{from.scale}) * weight);
    return door;
  }

  Random random_;
  std::shared_ptr<const StaticMesh> mesh_;
  Scene scene_;
  uint64_t tick_ = 0;
  uint64_t lives_ = 0;
  Doors doors_;
  std::map<uint64_t, Doors> past_;  // doors at the end of each tick
};

// Returns the first difference over `count` scenes of `ticks` ticks each; empty if there is none.
inline std::string search_door_lockstep(uint64_t count, int ticks) {
  for (uint64_t seed = 0; seed < count; ++seed) {
    const std::string what = DoorLockstep(seed).run(ticks);
    if (!what.empty()) return "seed " + std::to_string(seed) + ", " + what;
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_DOOR_LOCKSTEP_H_
