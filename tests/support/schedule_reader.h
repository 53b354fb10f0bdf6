// Reader of a scheduled scene (scene_schedule.h): queries the latest snapshot and random times of its history, and
// compares the answers with the schedule. Each reader belongs to one thread.
#ifndef LOCUS_TESTS_SUPPORT_SCHEDULE_READER_H_
#define LOCUS_TESTS_SUPPORT_SCHEDULE_READER_H_

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/owned_block.h"
#include "tests/support/random.h"
#include "tests/support/run_batch.h"
#include "tests/support/scene_schedule.h"

namespace locus::test {

class ScheduleReader {
 public:
  ScheduleReader(const Scene& scene, const SceneSchedule& schedule, uint64_t seed)
      : scene_(scene), schedule_(schedule), random_(seed) {}

  // Checks the latest snapshot of the scene. Returns a description of the error, or an empty string.
  std::string look() {
    const SnapshotPtr snapshot = scene_.latest();
    if (snapshot->revision < last_) return "revision " + std::to_string(snapshot->revision) + " after a later one";
    last_ = snapshot->revision;
    const uint64_t now = snapshot->revision - SceneSchedule::kFirstRevision;  // revision of the schedule
    ++looks_;
    if (std::string what = compare(*snapshot, now, {}); !what.empty()) return what;
    const uint64_t tick = SceneSchedule::tick_of(now);
    const uint64_t oldest = oldest_tick(*snapshot);
    if (oldest >= tick) return "";
    ++past_looks_;
    const uint64_t past = oldest + random_.below(tick - oldest);
    return compare(*snapshot, SceneSchedule::last_revision_of(past), past);
  }

  uint64_t looks() const { return looks_; }
  uint64_t past_looks() const { return past_looks_; }

 private:
  static uint64_t oldest_tick(const SceneSnapshot& snapshot) { return snapshot.oldest_tick(); }

  std::string compare(const SceneSnapshot& snapshot, uint64_t revision, std::optional<uint64_t> tick) {
    const std::string where =
        " at revision " + std::to_string(revision) + (tick ? ", asked as of tick " + std::to_string(*tick) : "");
    std::vector<uint64_t> ticks;
    if (tick) ticks.push_back(*tick);
    const Vec3d center = SceneSchedule::position(1 + random_.below(schedule_.objects()), random_.below(1'000));
    const auto radius = static_cast<float>(random_.below(12));
    std::vector<Id> expected;
    for (Id id = 1; id <= schedule_.last_door(); ++id)
      if (schedule_.meets({center, radius}, id, revision)) expected.push_back(id);
    if (ids_in_ball(snapshot, center, radius, ticks) != expected) return "a ball finds others" + where;
    for (int i = 0; i < 20; ++i)
      if (std::string what = compare_lookup(snapshot, revision, ticks); !what.empty()) return what + where;
    return "";
  }

  static std::vector<uint64_t> ids_in_ball(const SceneSnapshot& snapshot, Vec3d center, float radius,
                                           const std::vector<uint64_t>& ticks) {
    QueryBlock block;
    const Vec3f at = to_float(center);
    const float centers[] = {at.x, at.y, at.z}, radii[] = {radius};
    block.kind = BallColumns{centers, radii, StaticDetail::kInstances};
    block.max_results = limits::kMaxMaxResults;
    block.as_of_ticks = ticks;
    return run(snapshot, block).ids;
  }

  std::string compare_lookup(const SceneSnapshot& snapshot, uint64_t revision, const std::vector<uint64_t>& ticks) {
    const Id id = 1 + random_.below(schedule_.last_door());
    QueryBlock block;
    const uint64_t ids[] = {id};
    block.kind = LookupColumns{ids, {}};
    block.as_of_ticks = ticks;
    const BlockResult result = run(snapshot, block);
    const std::optional<Vec3d> at = schedule_.is_door(id)
                                        ? SceneSchedule::position(id, SceneSchedule::turn_of(id, revision))
                                        : SceneSchedule::at(id, revision);
    if ((result.ids[0] == id) != at.has_value()) return "object " + std::to_string(id) + " is or is not there";
    const Vec3d found{result.positions[0], result.positions[1], result.positions[2]};
    return !at || found == *at ? "" : "object " + std::to_string(id) + " is elsewhere";
  }

  static BlockResult run(const SceneSnapshot& snapshot, const QueryBlock& block) {
    QueryBatch batch;
    batch.blocks = {block};
    absl::StatusOr<BatchResult> result = run_batch(snapshot, batch, {});
    LOCUS_CHECK(result.ok());
    return std::move(result->blocks[0]);
  }

  const Scene& scene_;
  const SceneSchedule& schedule_;
  Random random_;
  uint64_t last_ = 0;
  uint64_t looks_ = 0;
  uint64_t past_looks_ = 0;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SCHEDULE_READER_H_
