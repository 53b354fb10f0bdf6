// A scene whose state at every revision can be computed: whether and how revision r changes an object depends only on r
// and the object's id. So readers can check the objects at the revision of their snapshot while the writer continues.
// Objects move, sometimes far, are removed and are inserted again; every tick has several revisions. The turn of an
// object is the revision of its last change.
#ifndef LOCUS_TESTS_SUPPORT_SCENE_SCHEDULE_H_
#define LOCUS_TESTS_SUPPORT_SCENE_SCHEDULE_H_

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/scene/scene.h"

namespace locus::test {

class SceneSchedule {
 public:
  static constexpr uint64_t kTurns = 8;  // number of revisions between two changes of an object
  // Number of revisions in a tick. It has no common factor with kTurns, so that the last revisions of successive ticks
  // change different objects.
  static constexpr uint64_t kRevisionsPerTick = 5;
  static constexpr float kRadius = 0.5f;

  explicit SceneSchedule(uint64_t objects) : objects_(objects) {}

  uint64_t objects() const { return objects_; }
  static uint64_t tick_of(uint64_t revision) { return revision / kRevisionsPerTick; }
  static uint64_t last_revision_of(uint64_t tick) { return tick * kRevisionsPerTick + kRevisionsPerTick - 1; }

  // Returns the last revision up to `revision` that changed the object; 0 if the object has not changed since begin(),
  // which inserts all objects.
  static uint64_t turn_of(Id id, uint64_t revision) {
    const uint64_t back = (revision + kTurns - id % kTurns) % kTurns;
    return revision >= back ? revision - back : 0;
  }
  static bool is_there(Id id, uint64_t turn) { return turn == 0 || mixed(id, turn) % 8 != 0; }
  // Returns the position of the object after its change at revision `turn`: near the object's home position, sometimes
  // far from the home position. Coordinates are multiples of 1/8, which floats represent exactly.
  static Vec3d position(Id id, uint64_t turn) {
    const uint64_t bits = mixed(id, turn + 77);
    const double far = bits % 64 == 0 ? 300 : 0;
    const auto part = [bits](int shift) { return static_cast<double>(bits >> shift & 31) / 8; };
    const auto home = [id](uint64_t stride) { return static_cast<double>(id * stride % 97); };
    return {home(13) + part(8) + far, home(29) + part(16), home(41) / 4 + part(24)};
  }

  // Returns the object's position at a revision; nullopt if the object does not exist at this revision.
  static std::optional<Vec3d> at(Id id, uint64_t revision) {
    const uint64_t turn = turn_of(id, revision);
    return is_there(id, turn) ? std::optional<Vec3d>(position(id, turn)) : std::nullopt;
  }

  // Inserts all objects into an empty scene. Revision 0 of the schedule is the scene's first revision, 1.
  void begin(Scene& scene) const {
    std::vector<uint64_t> ids(objects_);
    for (uint64_t i = 0; i < objects_; ++i) ids[i] = i + 1;
    apply(scene, 0, {}, ids, {});
  }

  // Applies the changes of revision `revision` of the schedule as one batch. Preconditions: the scene is at the
  // previous revision, and this revision changes at least one object. The second precondition holds if there are many
  // objects.
  void advance(Scene& scene, uint64_t revision) const {
    std::vector<uint64_t> gone, come, move;
    for (Id id = 1 + (revision + kTurns - 1) % kTurns; id <= objects_; id += kTurns) {
      if (id % kTurns != revision % kTurns) continue;
      const bool before = at(id, revision - 1).has_value(), now = is_there(id, revision);
      if (before && !now) gone.push_back(id);
      if (!before && now) come.push_back(id);
      if (before && now) move.push_back(id);
    }
    apply(scene, revision, gone, come, move);
  }

 private:
  static uint64_t mixed(uint64_t a, uint64_t b) {
    uint64_t z = a * 0x9E3779B97F4A7C15u + b * 0xD6E8FEB86659FD93u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  static std::vector<float> positions(const std::vector<uint64_t>& ids, uint64_t revision) {
    std::vector<float> numbers;
    for (const Id id : ids) {
      const Vec3f place = to_float(position(id, turn_of(id, revision)));
      numbers.insert(numbers.end(), {place.x, place.y, place.z});
    }
    return numbers;
  }
  static void apply(Scene& scene, uint64_t revision, const std::vector<uint64_t>& gone,
                    const std::vector<uint64_t>& come, const std::vector<uint64_t>& move) {
    UpdateBatch batch;
    batch.tick = tick_of(revision);
    batch.remove_ids = gone;
    const std::vector<float> come_to = positions(come, revision), move_to = positions(move, revision);
    const float radius[] = {kRadius};
    if (!come.empty()) {
      InsertColumns& insert = batch.inserts.emplace_back();
      insert.ids = come;
      insert.positions = come_to;
      insert.kind = ShapeKind::kBall;
      insert.radii = radius;
    }
    if (!move.empty()) {
      MoveColumns& columns = batch.moves.emplace_back();
      columns.ids = move;
      columns.positions = move_to;
    }
    const absl::StatusOr<UpdateAck> ack = scene.apply(batch);
    LOCUS_CHECK(ack.ok());
    LOCUS_CHECK_EQ(ack->refused, 0u);
    LOCUS_CHECK_EQ(ack->revision, revision + 1);
  }

  uint64_t objects_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SCENE_SCHEDULE_H_
