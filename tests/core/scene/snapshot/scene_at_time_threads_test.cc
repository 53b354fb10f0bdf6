// Tests readers that query random past times while a fast writer runs: every answer matches the recorded state.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/scene/scene.h"
#include "core/scene/snapshot/scene_at_time.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr uint64_t kMovers = 500;

// Returns whether object `id` exists at `tick`. At tick t, an existing object i is at (t, i, 0).
bool lives(uint64_t id, uint64_t tick) { return id % 7 != tick % 7; }

void apply_tick(Scene& scene, uint64_t tick) {
  std::vector<uint64_t> ids, removed;
  std::vector<double> places;
  for (uint64_t id = 1; id <= kMovers; ++id) {
    if (!lives(id, tick) && tick > 1 && lives(id, tick - 1)) removed.push_back(id);
    if (!lives(id, tick)) continue;
    ids.push_back(id);
    places.insert(places.end(), {static_cast<double>(tick), static_cast<double>(id), 0});
  }
  UpdateBatch batch;
  InsertColumns insert;
  insert.ids = ids;
  insert.positions_f64 = places;
  batch.inserts.push_back(insert);
  batch.upsert = true;
  batch.remove_ids = removed;
  batch.tick = tick;
  ASSERT_TRUE(scene.apply(batch).ok());
}

void expect_past(const SceneSnapshot& snapshot, Random& random) {
  const uint64_t oldest = std::max<uint64_t>(snapshot.oldest_tick(), 1);
  const uint64_t tick = oldest + random.below(snapshot.tick - oldest + 1);
  const float fraction = tick == snapshot.tick || random.chance(0.3) ? 0 : 0.5f;
  const SceneAtTime moment = find_scene_at(snapshot, {tick, fraction}).value();
  const uint64_t id = 1 + random.below(kMovers);
  const double x = static_cast<double>(tick) + (fraction != 0 && lives(id, tick + 1) ? 0.5 : 0);
  size_t found = 0;
  Work work;
  const Vec3d place{x, static_cast<double>(id), 0};
  const Aabbd bounds = {place, place};
  const auto ask = [&](const auto& visit) { moment.region(bounds, std::nullopt).visit(work, visit); };
  moment.visit_asked(bounds, work, ask, [&](const GridRef& object) {
    if (moment.shape(object).position == place) ++found;
    return true;
  });
  EXPECT_EQ(found, lives(id, tick) ? 1u : 0u) << "object " << id << " at tick " << tick << "+" << fraction;
}

TEST(SceneAtTimeThreadsTest, ReadersFindThePastWhileTheWriterContinues) {
  SceneSpec spec;
  spec.history = {12, uint64_t{1} << 30};
  Scene scene("scene", spec, 1, StaticSet::empty());
  apply_tick(scene, 1);
  std::atomic<bool> done{false};
  std::atomic<uint64_t> reads{0};
  const auto read = [&](uint64_t seed) {
    Random random(seed);
    while (!done.load()) {
      const SnapshotPtr snapshot = scene.latest();
      for (int i = 0; i < 20; ++i) expect_past(*snapshot, random);
      ++reads;
    }
  };
  std::thread first(read, 1), second(read, 2);
  for (uint64_t tick = 2; tick <= scaled_count(500) || reads.load() < scaled_count(200); ++tick)
    apply_tick(scene, tick);
  done.store(true);
  first.join();
  second.join();
}

}  // namespace
}  // namespace locus::test
