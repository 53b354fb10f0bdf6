// A scene whose state at every revision can be computed: whether and how revision r changes an object depends only on r
// and the object's id. So readers can check the objects at the revision of their snapshot while the writer continues.
// Objects move, sometimes far, are removed and are inserted again; every tick has several revisions. The turn of an
// object is the revision of its last change. Some objects are compounds. Doors are instances of one triangle, which
// move like objects, with ids above those of objects, but are never removed.
#ifndef LOCUS_TESTS_SUPPORT_SCENE_SCHEDULE_H_
#define LOCUS_TESTS_SUPPORT_SCENE_SCHEDULE_H_

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include "core/geometry/triangle_overlap.h"
#include "core/scene/scene.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {

class SceneSchedule {
 public:
  static constexpr uint64_t kTurns = 8;  // number of revisions between two changes of an object
  // Number of revisions in a tick. It has no common factor with kTurns, so that the last revisions of successive ticks
  // change different objects.
  static constexpr uint64_t kRevisionsPerTick = 5;
  static constexpr float kRadius = 0.5f;
  static constexpr uint64_t kDoors = 64;
  static constexpr Triangle kDoor = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, 0};
  // Positions of the parts of a compound, which are balls of radius kRadius.
  static constexpr Vec3f kParts[] = {{0, 0, 0}, {2, 0, 0}, {0, 3, -1}};

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

  static bool is_compound(Id id) { return id % 16 == 3; }
  bool is_door(Id id) const { return id > objects_; }
  Id last_door() const { return objects_ + kDoors; }

  // Returns whether the ball meets the object or the door at a revision.
  bool meets(const Balld& ball, Id id, uint64_t revision) const {
    if (is_door(id)) {
      const Vec3f center = to_float(ball.center - position(id, turn_of(id, revision)));
      return ball_overlaps(Ballf{center, static_cast<float>(ball.radius)}, kDoor);
    }
    const std::optional<Vec3d> whole = at(id, revision);
    const auto meets_ball = [&](const Vec3f& part) {
      return ball_overlaps(ball, Shape{ShapeKind::kBall, *whole + to_double(part), {}, {}, kRadius});
    };
    return whole && (meets_ball(kParts[0]) ||
                     (is_compound(id) && std::any_of(std::begin(kParts), std::end(kParts), meets_ball)));
  }

  // Revision of the scene at revision 0 of the schedule.
  static constexpr uint64_t kFirstRevision = 2;
  // Places all doors in an empty scene, and then inserts all objects.
  void begin(Scene& scene) const {
    StaticChange change;
    PlacementColumns& doors = change.place.emplace_back();
    doors.mesh = make_mesh("door", 1, {0, 0, 0, 4, 0, 0, 0, 4, 0});
    std::vector<uint64_t> door_ids;
    std::vector<double> places;
    for (Id id = objects_ + 1; id <= last_door(); ++id) {
      door_ids.push_back(id);
      const Vec3d place = position(id, 0);
      places.insert(places.end(), {place.x, place.y, place.z});
    }
    doors.ids = door_ids;
    doors.translations = places;
    LOCUS_CHECK(scene.change_instances(change).ok());
    std::vector<uint64_t> ids(objects_);
    for (uint64_t i = 0; i < objects_; ++i) ids[i] = i + 1;
    apply(scene, 0, {}, ids, {}, {});
  }

  // Applies the changes of revision `revision` of the schedule as one batch. Preconditions: the scene is at the
  // previous revision, and this revision changes at least one object. The second precondition holds if there are many
  // objects.
  void advance(Scene& scene, uint64_t revision) const {
    std::vector<uint64_t> gone, come, move, doors;
    for (Id id = 1 + (revision + kTurns - 1) % kTurns; id <= last_door(); id += kTurns) {
      if (id % kTurns != revision % kTurns) continue;
      if (is_door(id)) {
        doors.push_back(id);
        continue;
      }
      const bool before = at(id, revision - 1).has_value(), now = is_there(id, revision);
      if (before && !now) gone.push_back(id);
      if (!before && now) come.push_back(id);
      if (before && now) move.push_back(id);
    }
    apply(scene, revision, gone, come, move, doors);
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
                    const std::vector<uint64_t>& come, const std::vector<uint64_t>& move,
                    const std::vector<uint64_t>& doors) {
    UpdateBatch batch;
    batch.tick = tick_of(revision);
    batch.remove_ids = gone;
    std::vector<uint64_t> balls, compounds;
    for (const Id id : come) (is_compound(id) ? compounds : balls).push_back(id);
    const std::vector<float> balls_to = positions(balls, revision), compounds_to = positions(compounds, revision),
                             move_to = positions(move, revision), doors_to = positions(doors, revision);
    const float radius[] = {kRadius};
    if (!balls.empty()) {
      InsertColumns& insert = batch.inserts.emplace_back();
      insert.ids = balls;
      insert.positions = balls_to;
      insert.kind = ShapeKind::kBall;
      insert.radii = radius;
    }
    if (!compounds.empty()) {
      InsertColumns& insert = batch.inserts.emplace_back();
      insert.ids = compounds;
      insert.positions = compounds_to;
      insert.kind = ShapeKind::kCompound;
      PartColumns& parts = insert.parts.emplace_back();
      parts.positions = {&kParts[0].x, 3 * std::size(kParts)};
      parts.radii = radius;
    }
    if (!move.empty()) {
      MoveColumns& columns = batch.moves.emplace_back();
      columns.ids = move;
      columns.positions = move_to;
    }
    if (!doors.empty()) {
      InstanceMoveColumns& columns = batch.instance_moves.emplace_back();
      columns.ids = doors;
      columns.positions = doors_to;
    }
    const absl::StatusOr<UpdateAck> ack = scene.apply(batch);
    LOCUS_CHECK(ack.ok());
    LOCUS_CHECK_EQ(ack->refused, 0u);
    LOCUS_CHECK_EQ(ack->revision, revision + kFirstRevision);
  }

  uint64_t objects_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SCENE_SCHEDULE_H_
